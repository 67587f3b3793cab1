"""How the tests are spread over several workers: files that share costly results stay together, long ones go first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pytest
from xdist.scheduler import LoadFileScheduling

TOGETHER: Mapping[str, Sequence[str]] = {
    "tests/identification/tracing/test_trace.py": (
        "tests/identification/report/test_report_trace.py",
        "tests/identification/tracing/test_trace_budget.py",
        "tests/identification/tracing/test_trace_null.py",
        "tests/identification/tracing/test_trace_orders.py",
        "tests/identification/tracing/test_trace_screen.py",
        "tests/identification/tracing/test_trace_shortlist.py",
        "tests/identification/tracing/test_trace_several.py",
    ),
    "tests/identification/report/test_report.py": (
        "tests/identification/report/test_report_browser.py",
        "tests/identification/fit/test_own_effect.py",
    ),
}
"""Files by the first one of those with which they share traces or fits: one worker runs them, and makes each once."""

FIRST = (
    "tests/identification/tracing/test_trace.py",
    "tests/docs/test_pages.py",
    "tests/command/test_demo_command.py",
    "tests/test_examples.py",
    "tests/identification/fit/test_order.py",
    "tests/detector/test_evaluation_run.py",
    "tests/hil/monitor/test_monitor_served.py",
    "tests/identification/fit/test_fit_recovery.py",
)
"""What takes longest, so that no worker still has one of them when the others are done."""

SHARED_WITH = {path: first for first, others in TOGETHER.items() for path in (first, *others)}


def part(nodeid: str) -> str:
    """The part of the work to which a test belongs: its file, or the first of the files that are run with it."""
    path = nodeid.split("::", 1)[0]
    return SHARED_WITH.get(path, path)


def longest_first(items: list[pytest.Item]) -> None:
    """Sort tests so that the long parts come first, and otherwise as they were found."""
    items.sort(key=lambda item: FIRST.index(part(item.nodeid)) if part(item.nodeid) in FIRST else len(FIRST))


class PartScheduling(LoadFileScheduling):
    """Gives a worker one part after another."""

    def _split_scope(self, nodeid: str) -> str:
        return part(nodeid)
