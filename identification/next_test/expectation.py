"""What a sequence is expected to achieve, for one that is proposed and for the tests it is compared with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identification.next_test.information import answered, expected_std, fitted_apart
from identification.next_test.knowledge import DrivenTest, KnownValve
from identification.uncertainty.covariance import WEAK
from recordings import Array

TOLD = 5.0
"""Distance [noise sigmas] from which rivals are told apart: chance makes it in less than one test of a million."""


@dataclass(frozen=True)
class Expectation:
    """std : of every free parameter of the first model after the test, SI units; distances : of every pair of models,
    by their names, in noise sigmas; paths : expected positions [m] by model.
    """

    std: Mapping[str, float]
    distances: Mapping[tuple[str, str], float]
    paths: Mapping[str, Array]

    @property
    def distance(self) -> float:
        """Of the nearest rivals; infinite where there are none."""
        return min(self.distances.values(), default=float("inf"))

    def still_weak(self, valve: KnownValve, names: tuple[str, ...]) -> tuple[str, ...]:
        """Which of some parameters will be weak after the test all the same."""
        return tuple(name for name in names if self.std[name] > WEAK * abs(valve.values[name]))


def expectation(valves: tuple[KnownValve, ...], test: DrivenTest) -> Expectation | None:
    """What a test is expected to achieve. Rivals are fitted to one another's answers. None where a model diverges."""
    answers = [answered(valve, test) for valve in valves]
    known = [one for one in answers if one is not None]
    if len(known) < len(valves):
        return None
    std = dict(zip(valves[0].names, expected_std(valves[0], known[0]).tolist(), strict=True))
    distances = {}
    for i, one in enumerate(valves):
        for j in range(i + 1, len(valves)):
            ways = fitted_apart(known[i].y, valves[j], test), fitted_apart(known[j].y, one, test)
            distances[one.name, valves[j].name] = float(np.min(ways))
    return Expectation(std, distances, {v.name: path.y for v, path in zip(valves, known, strict=True)})
