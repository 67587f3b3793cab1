"""Fixtures that any room's tests may use."""

from __future__ import annotations

import math
import signal
from collections.abc import Iterator

import pytest
from _browser import Browser, chromium
from _workers import PartScheduling, longest_first


def pytest_configure() -> None:
    """Commands that tests start hear an interrupt, even where the tests run behind a shell, which has it ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long tests come first."""
    longest_first(items)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> PartScheduling:
    """Files that share costly results are run by one worker."""
    return PartScheduling(config, log)


@pytest.fixture(autouse=True, scope="session")
def _no_progress() -> None:
    """Lines of progress come when the clock says so, and would stand among what a test reads on a busy machine."""
    from bristle.cli.output import working

    working.SOON_S = math.inf


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A headless Chromium for tests of pages; they are skipped where there is none."""
    programs = chromium()
    if programs is None:
        pytest.skip("Chromium or chromedriver is not installed (Debian: apt-get install chromium chromium-driver)")
    with Browser(programs) as started:
        yield started
