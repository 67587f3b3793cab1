"""Fixtures that any room's tests may use."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from _browser import Browser, chromium


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A headless Chromium for tests of pages; they are skipped where there is none."""
    programs = chromium()
    if programs is None:
        pytest.skip("Chromium or chromedriver is not installed (Debian: apt-get install chromium chromium-driver)")
    with Browser(programs) as started:
        yield started
