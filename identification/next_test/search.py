"""The search for the sequence that tells most: every family from several shapes, the best ones bent further."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from identification.next_test.drive import StemDrive
from identification.next_test.information import answered, apart, gained
from identification.next_test.knowledge import DrivenTest, ExpectedPath, KnownValve
from identification.next_test.waveforms import SHAPE, WAVEFORMS
from recordings import Array, Progress

STARTS = 8
"""Shapes of every family that are tried at first."""
BENT = 2
"""Families that are bent further."""
FORBIDDEN = -1e6
"""What a sequence is worth that leaves the travel, or that a model cannot answer."""
SEEDS = 2026


@dataclass(frozen=True)
class FoundSequence:
    """A sequence of a family and what it is worth. demand (n_samples,) within 0 and 1."""

    family: str
    demand: Array
    worth: float


@dataclass(frozen=True)
class DesignAim:
    """What a test is for. valves : the models, the first of which is driven; weak : the parameters to find by full
    name, where it is not to tell the models apart; supposed : valves that each model may be.
    """

    valves: tuple[KnownValve, ...]
    weak: tuple[str, ...]
    supposed: tuple[tuple[KnownValve, ...], ...]

    def worth(self, test: DrivenTest, drive: StemDrive) -> float:
        """How much a test tells: by how many noise sigmas the nearest rivals differ (its logarithm), or what is gained
        of the weak parameters, on the average of the valves that each may be."""
        answers = [answered(valve, test) for valve in self.valves]
        known = [one for one in answers if one is not None]
        if len(known) < len(answers):
            return FORBIDDEN
        if not all(drive.keeps(one.y, valve) for one, valve in zip(known, self.valves, strict=True)):
            return FORBIDDEN
        return self._gained(test) if len(self.valves) == 1 else self._apart(test, known)

    def _apart(self, test: DrivenTest, known: Sequence[ExpectedPath]) -> float:
        found = []
        for i, valves in enumerate(self.supposed):
            paths = [one.path(test, one.p, one.at_rest(float(test.force[0]))) for one in valves]
            rivals = [j for j in range(len(known)) if j != i]
            found += [min(apart(y, self.valves[j], known[j]) for j in rivals) for y in paths if y is not None]
        return float(np.mean(np.log(np.maximum(found, 1e-9)))) if found else FORBIDDEN

    def _gained(self, test: DrivenTest) -> float:
        answers = [(one, answered(one, test)) for one in self.supposed[0]]
        known = [gained(one, answer, self.weak) for one, answer in answers if answer is not None]
        return float(np.mean(known)) if len(known) == len(answers) else FORBIDDEN


def searched(
    aim: DesignAim, drive: StemDrive, t: Array, h_max: float, bends: int, progress: Progress
) -> list[FoundSequence]:
    """The best sequence of every family, best first. bends : further trials of each of the best families."""
    share, done, total = t / t[-1], 0, STARTS * len(WAVEFORMS) + BENT * bends

    def worth(demand: Array) -> float:
        nonlocal done
        done += 1
        progress("search", min(done, total), total)
        return aim.worth(drive.test(t, drive.asked(t, demand), h_max), drive)

    shapes = qmc.Sobol(SHAPE, seed=SEEDS).random(STARTS)
    found: list[tuple[str, Array, float]] = []
    for family, wave in WAVEFORMS.items():
        tried = [(shape, worth(wave(share, shape))) for shape in shapes]
        found.append((family, *max(tried, key=lambda one: one[1])))
    found.sort(key=lambda one: -one[2])
    bent = [_bent(family, share, shape, worth, bends) for family, shape, _ in found[:BENT]]
    ranked = sorted([*bent, *found[BENT:]], key=lambda one: -one[2])
    return [FoundSequence(family, WAVEFORMS[family](share, shape), value) for family, shape, value in ranked]


def _bent(
    family: str, share: Array, shape: Array, worth: Callable[[Array], float], bends: int
) -> tuple[str, Array, float]:
    """A family's shape, bent by so many trials of a simplex (Nelder and Mead 1965)."""
    first = np.vstack([shape, *(shape + np.where(shape < 0.5, 0.25, -0.25) * row for row in np.eye(SHAPE))])
    end = minimize(
        lambda s: -worth(WAVEFORMS[family](share, np.clip(s, 0.0, 1.0))), shape, method="Nelder-Mead",
        options={"maxfev": bends, "initial_simplex": first},
    )  # fmt: skip
    return family, np.clip(end.x, 0.0, 1.0), -float(end.fun)


def allowed(found: Sequence[FoundSequence]) -> list[FoundSequence]:
    """Those that keep the travel."""
    return [one for one in found if one.worth > FORBIDDEN]
