"""Fixtures that any room's tests may use."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest
from _browser import Browser, chromium


def pytest_configure() -> None:
    """Commands that tests start hear an interrupt, even where the tests run behind a shell, which has it ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A headless Chromium for tests of pages; they are skipped where there is none."""
    programs = chromium()
    if programs is None:
        pytest.skip("Chromium or chromedriver is not installed (Debian: apt-get install chromium chromium-driver)")
    with Browser(programs) as started:
        yield started
