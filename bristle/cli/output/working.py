"""Signs of life while something takes its time: what is being done, how much of it, and for how long.

On a terminal one line that changes. Elsewhere, in a log, a line when two seconds are over and at every new stage, and
now and then while a stage lasts. With ``--verbose`` lines everywhere, one for each stage from the beginning on.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from bristle.cli.output.manner import manner
from recordings import Progress, silent

SOON_S = 2.0
"""What is over sooner needs no line."""
BETWEEN_S = 2.0
"""Between the lines of two stages at least."""
FIRST_PAUSE_S, LONGEST_S = 5.0, 60.0
"""Between two lines of one stage, the first and the longest pause; they grow."""


@contextmanager
def working(what: str, *, staged: bool = False, budget: float = math.inf) -> Iterator[Progress]:
    """Meanwhile the user sees what is done; gives the `Progress` to tell it the stages.

    staged : whether the work tells its stages. Then no line comes before the first, so that input that cannot be used
    is refused in one line. budget : time that the work may take, of which is shown how much is left [s]; it is
    counted from here, a little before the work counts it.
    """
    chosen = manner()
    if chosen.quiet:
        yield silent
    elif sys.stderr.isatty() and not chosen.verbose:
        with _on_terminal(what, budget) as report:
            yield report
    else:
        after_s, between_s = (0.0, 0.0) if chosen.verbose else (SOON_S, BETWEEN_S)
        lines = _StageLines(what, after_s, between_s, staged and not chosen.verbose, budget)
        with _kept(lines):
            yield lines.report


def stage_words(stage: str, done: int, total: int) -> str:
    """A stage, and how much of it is done.

    >>> stage_words("starting values", 2, 5), stage_words("refitting", 0, 0)
    ('starting values: 2 of 5', 'refitting')
    """
    return f"{stage}: {done} of {total}" if total else stage


def time_words(passed: float, budget: float) -> str:
    """How long it has taken, and how much of a budget is left [s].

    >>> time_words(23.4, 120.0), time_words(23.4, math.inf)
    ('23 s, 97 s left', '23 s')
    """
    return f"{passed:.0f} s" if budget == math.inf else f"{passed:.0f} s, {max(budget - passed, 0.0):.0f} s left"


@contextmanager
def _on_terminal(what: str, budget: float) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import ProgressColumn, SpinnerColumn, Task, TextColumn
    from rich.text import Text

    class Time(ProgressColumn):
        """Computed whenever the line is drawn, so it goes on while a stage lasts."""

        def render(self, task: Task) -> Text:
            return Text(time_words(task.elapsed or 0.0, budget))

    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), Time())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what)

        def report(stage: str, done: int, total: int) -> None:
            bar.update(task, description=f"{what}: {stage_words(stage, done, total)}")

        yield report


@contextmanager
def _kept(lines: _StageLines) -> Iterator[None]:
    ended = threading.Event()
    clock = threading.Thread(target=lines.keep, args=(ended,), daemon=True, name="progress")
    clock.start()
    try:
        yield
    finally:
        ended.set()
        clock.join()


class _StageLines:
    """Lines about stages. after_s : when the first may come; between_s : at least so long between two [s];
    staged : none before the first stage; budget : of `working`.
    """

    def __init__(
        self, what: str, after_s: float, between_s: float, staged: bool = False, budget: float = math.inf
    ) -> None:
        self._silent, self._budget = staged, budget
        self._what, self._after_s, self._between_s = what, after_s, between_s
        self._began = time.monotonic()
        self._said_s: float | None = None
        self._pause_s = FIRST_PAUSE_S
        self._words, self._stage, self._news = what, "", True
        self._lock = threading.Lock()

    def report(self, stage: str, done: int, total: int) -> None:
        """As `Progress` has it; called from the thread that works."""
        with self._lock:
            self._silent = False
            if stage != self._stage:
                self._stage, self._news, self._pause_s = stage, True, FIRST_PAUSE_S
            self._words = f"{self._what}: {stage_words(stage, done, total)}"
            self._say_when_due()

    def keep(self, ended: threading.Event) -> None:
        """Say something now and then until the work has ended."""
        while not ended.wait(0.2):
            with self._lock:
                self._say_when_due()

    def _say_when_due(self) -> None:
        passed = time.monotonic() - self._began
        since = math.inf if self._said_s is None else passed - self._said_s
        if self._silent or passed < self._after_s or since < (self._between_s if self._news else self._pause_s):
            return
        print(f"{self._words} ({time_words(passed, self._budget)})", file=sys.stderr, flush=True)
        self._pause_s = self._pause_s if self._news else min(2 * self._pause_s, LONGEST_S)
        self._said_s, self._news = passed, False
