"""A detector of somebody's own in an evaluation, and the processes that the work is spread over."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
import pytest

from detector.evaluation import DETECTORS, BenchmarkRun, Channels, detected, evaluate, smoke, write
from detector.evaluation.jobs import key
from detector.evaluation.processes import in_processes
from recordings import BadInput, silent

POSITION, FLOW = 4, 5


@dataclass(frozen=True)
class FlowWatch:
    """How far the flow is from what it usually is at the position."""

    text: str = "flow against position"

    def learn(self, healthy: BenchmarkRun) -> Channels:
        usual = np.polyfit(healthy.signals[100:, POSITION], healthy.signals[100:, FLOW], 5)
        return lambda run: run.signals[:, [FLOW]] - np.polyval(usual, run.signals[:, [POSITION]])


@pytest.mark.long  # `examples/own_detector.py` does the same
def test_a_detector_of_ones_own_is_compared_beside_the_others(tmp_path):
    plan = smoke(("random",), ("f18-abrupt-big",))
    outcome = evaluate(plan, tmp_path, workers=2, detectors={"flow": FlowWatch()})
    assert outcome.plan.detectors == ("random", "flow")
    assert outcome.texts["flow"] == "flow against position"
    assert detected(outcome, "play-1", "f18-abrupt-big", "flow")[:2] == (1, 1)
    page = next(path for path in write(outcome, tmp_path) if path.name == "evaluation.html")
    assert "flow against position" in page.read_text()


def test_results_belong_to_the_detector_that_made_them():
    plan = smoke(("random",))
    built_in = {"random": DETECTORS["random"]}
    assert key(plan, built_in) == plan.key
    texts = [key(plan, {**built_in, "flow": FlowWatch(text)}) for text in ("first", "second", "first")]
    assert texts[0] == texts[2] != texts[1]
    assert plan.key not in texts


@pytest.mark.parametrize("count", [1, 3])
def test_results_come_in_the_order_of_the_items_and_progress_reaches_the_end(count):
    reports = []
    results = in_processes(lambda x: x * x, range(20), count, lambda *report: reports.append(report), "squares")
    assert results == [x * x for x in range(20)]
    assert reports == [("squares", done, 20) for done in range(21)]


def test_what_fails_in_a_process_is_raised_here():
    def fail(item):
        raise BadInput("item", str(item), "none")

    with pytest.raises(BadInput, match="item: 3; none"):
        in_processes(fail, [3, 3, 3], 2, silent, "failing")


def test_a_process_that_dies_is_told_instead_of_waited_for():
    with pytest.raises(RuntimeError, match="a worker process ended"):
        in_processes(lambda _: os._exit(3), [1, 2, 3], 2, silent, "dying")


def test_the_work_of_a_process_needs_not_be_picklable():
    detector = FlowWatch()
    assert in_processes(lambda k: (k, detector.text), range(3), 2, silent, "x")[2] == (2, "flow against position")
