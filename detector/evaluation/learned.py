"""Everything a variant's detectors have learned, and what they make of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detector.evaluation.contract import BenchmarkRun, Channels, Detector
from detector.evaluation.isolation.diagnosis import Diagnosis
from detector.evaluation.isolation.symptoms import Symptoms, learn_symptoms
from detector.evaluation.levels import Levels, alarms, largest
from recordings import Array

SETTLE_S = 300
"""Alarms count from here on: the benchmark's ton [s]."""

BANK = "bank"
"""The detector whose symptoms the diagnosis reads."""


@dataclass(frozen=True, eq=False)
class Learned:
    """symptoms : learned; channels, levels : by detector; diagnosis : None until its signatures are learned."""

    symptoms: Symptoms
    channels: Mapping[str, Channels]
    levels: Mapping[str, Levels]
    diagnosis: Diagnosis | None = None

    def blocks(self, run: Array, block_s: int) -> dict[str, Array]:
        """Largest values of each detector's channels in blocks of a fault-free run."""
        data = BenchmarkRun(run, self.symptoms)
        return {name: largest(channels(data), SETTLE_S, block_s) for name, channels in self.channels.items()}

    def statistics(self, data: BenchmarkRun) -> dict[str, Array]:
        """One number a second (n,) by detector, an alarm above 1."""
        return {name: levels.statistic(self.channels[name](data)) for name, levels in self.levels.items()}

    def alarms(self, data: BenchmarkRun) -> tuple[dict[str, Array], dict[str, NDArray[np.bool_]]]:
        """Statistics and alarms (n,) by detector; none during the first `SETTLE_S`."""
        statistics = self.statistics(data)
        raised = {}
        for name, statistic in statistics.items():
            quiet = statistic.copy()
            quiet[:SETTLE_S] = 0.0
            raised[name] = alarms(quiet)
        return statistics, raised


def learn(runs: Sequence[Array], detectors: Mapping[str, Detector]) -> Learned:
    """From fault-free runs: the relations and what is usual, then each detector. Levels are still missing."""
    symptoms = learn_symptoms(runs)
    healthy = BenchmarkRun(runs[0], symptoms)
    return Learned(symptoms, {name: one.learn(healthy) for name, one in detectors.items()}, {})
