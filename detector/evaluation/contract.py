"""What a detector is to an evaluation: it learns from a fault-free run, then makes channels of any run.

A channel is any number that grows in size when something is wrong; levels and threshold are set for all alike
(`detector.evaluation.levels`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from detector.evaluation.isolation.symptoms import Symptoms
from recordings import Array


class BenchmarkRun:
    """A run of the benchmark, and its symptoms, worked out once for all detectors that use them.

    signals : (n, 6), columns `SIGNALS`, a row a second; model : what was learned of the fault-free plant.
    """

    def __init__(self, signals: Array, model: Symptoms) -> None:
        self.signals, self.model = signals, model

    @cached_property
    def symptoms(self) -> Array:
        """As `Symptoms.of`, (n, n_symptoms)."""
        return self.model.of(self.signals)


Channels = Callable[[BenchmarkRun], Array]
"""From a run of n seconds to channels (n, n_channels)."""


class Detector(Protocol):
    """What can be compared: it learns from a fault-free run, and then makes channels of any run."""

    @property
    def text(self) -> str:
        """What it is, in a line."""
        ...

    def learn(self, healthy: BenchmarkRun, /) -> Channels:
        """Learn from a fault-free run of some hours. Raises BadInput when that is not enough."""
        ...


@dataclass(frozen=True)
class LearnedDetector:
    """A detector made of a function. text : what it is; learn : from a fault-free run to channels of any run."""

    text: str
    learn: Callable[[BenchmarkRun], Channels]
