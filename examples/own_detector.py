"""A detector of your own beside those of the toolkit, on faults of the DAMADICS benchmark.

    python examples/own_detector.py [FOLDER]

A detector learns from a fault-free run, and then makes channels of any run: numbers whose size grows when something
is wrong; the sign does not matter. Thresholds are set for all detectors in the same way, so that all have the same
rate of false alarms.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from detector.evaluation import BenchmarkRun, Channels, detected, evaluate, smoke, write

POSITION, FLOW = 4, 5
"""Columns of the benchmark's signals."""

FAULTS = ("f18-abrupt-big", "f7-abrupt-medium")
"""A bypass valve that is partly open, and a medium that evaporates."""


@dataclass(frozen=True)
class FlowWatch:
    """How far the flow is from what it usually is at the position of the stem."""

    text: str = "flow against position"

    def learn(self, healthy: BenchmarkRun) -> Channels:
        """The usual flow is a polynomial of the position, fitted to the fault-free run."""
        usual = np.polyfit(healthy.signals[100:, POSITION], healthy.signals[100:, FLOW], 5)

        def channels(run: BenchmarkRun) -> np.ndarray:
            return run.signals[:, [FLOW]] - np.polyval(usual, run.signals[:, [POSITION]])

        return channels


def main(folder: Path) -> None:
    """Compare the detector with a small selection of others, and write tables and a page to a folder."""
    # `smoke` is the smallest plan that goes through everything. Leave it out of serious work: Plan() is the benchmark.
    outcome = evaluate(smoke(("random", "limits"), FAULTS), folder, detectors={"flow": FlowWatch()})
    for fault in FAULTS:
        for name in outcome.plan.detectors:
            found, trials, *_ = detected(outcome, "play-1", fault, name)
            print(f"{fault:18} {name:8} found in {found} of {trials} trials")
    write(outcome, folder)
    print(f"wrote evaluation.md and evaluation.html to {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "evaluation"))
