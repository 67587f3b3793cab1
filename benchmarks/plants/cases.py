"""Cases for `benchmarks.trace`, and the plant of `benchmarks.plants` running their experiments."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmarks.plants.effects import CLAMPS, STALL, Valve, fields_of
from benchmarks.plants.integration import STEP, integrate
from recordings import Array

SECONDS = {"staircase": 40.0, "sine": 50.0, "multisine": 40.0}
"""The experiments, the last of them held out."""
FITTED = ("staircase", "sine")
COURSE = 500.0
"""Rate at which the force is laid down [Hz]; it moves straight in between."""


@dataclass(frozen=True)
class Case:
    """One set of recordings. effects : ids in the plant, none for a control; strength : root mean square of what is
    left of each effect's trace in the position when the base is fitted again, in standard deviations of the noise.

    rate [Hz]; slow : at a rate below 500, whether ``both`` channels or the ``position`` alone are sampled slowly;
    noise : factor on the position noise of the valve; form : of the laws, see `benchmarks.plants.effects`; rig : the
    recordings say that a rig imposed the motion, so that the force is predicted.
    """

    valve: int
    effects: tuple[str, ...] = ()
    strength: float = 0.0
    form: str = "same"
    rate: float = COURSE
    slow: str = "both"
    noise: float = 1.0
    seed: int = 0
    rig: bool = False

    @property
    def name(self) -> str:
        """A short unique name, fit for a folder."""
        what = "+".join(self.effects) or "none"
        slow = "" if self.rate == COURSE else f"-{self.rate:g}Hz-{self.slow}"
        noise = "" if self.noise == 1.0 else f"-n{self.noise:g}"
        return f"{what}-v{self.valve}-s{self.strength:g}-{self.form}{slow}{noise}{'-rig' * self.rig}" + (
            f"-{self.seed}" * (self.seed > 0)
        )


@dataclass(frozen=True)
class Run:
    """A plant that ran one experiment, at `COURSE`. t [s]; force [N] as it was; reading [m] without noise."""

    t: Array
    force: Array
    reading: Array
    position: Array
    velocity: Array


def force_course(valve: Valve, shape: str, seconds: float, seed: int) -> Array:
    """Force [N] of an actuator on (n_samples,) at `COURSE`: the whole stroke and some more for friction, through the
    20 ms of its chamber. A staircase of ten levels, a slow sine of four periods, or a multisine of 30 lines up to
    30 periods with random phases.
    """
    rng = np.random.default_rng([valve.seed, seed, len(shape)])
    t = np.arange(round(seconds * COURSE) + 1) / COURSE
    if shape == "staircase":
        demand = rng.uniform(-0.8, 0.8, 10)[np.minimum((t * 10 / seconds).astype(int), 9)]
    elif shape == "sine":
        demand = -0.8 * np.cos(2 * np.pi * 4 * t / seconds)
    else:
        lines = np.arange(1, 31)
        demand = np.cos(2 * np.pi * np.outer(t / seconds, lines) + rng.uniform(0, 2 * np.pi, 30)).sum(axis=1)
        demand *= 0.8 / np.abs(demand).max()
    wanted = valve.load + demand * (0.5 * valve.span + 1.25 * valve.friction)
    keep = np.exp(-1 / (0.02 * COURSE))
    course: Array = lfilter([1 - keep], [1, -keep], wanted - wanted[0]) + wanted[0]
    return course


def runs(
    case: Case, strengths: dict[str, float], shapes: Iterable[str] | None = None, step: float = STEP
) -> dict[str, Run]:
    """The plant of a case, with given strengths of its effects, on some experiments, in steps of at most `step` [s]."""
    valve = Valve.of(case.valve)
    physics = valve.physics(fields_of(strengths, valve, case.form))
    found = {}
    for shape in shapes or SECONDS:
        force = force_course(valve, shape, SECONDS[shape], case.seed)
        rng = np.random.default_rng([case.valve, case.seed, len(shape), 3])
        closed = _spells(len(force), CLAMPS, CLAMPS / 5, rng) if "closing_clamp" in strengths else None
        out = integrate(physics, force, COURSE, closed=closed, step=step)
        reading = out[:, 0]
        if "repeated_samples" in strengths:
            stalled = _spells(len(force), STALL, 2.0 * strengths["repeated_samples"], rng)
            reading = reading[np.maximum.accumulate(np.where(stalled, 0, np.arange(len(force))))]
        found[shape] = Run(np.arange(len(force)) / COURSE, force, reading, out[:, 1], out[:, 2])
    return found


def _spells(n: int, every: float, length: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Random spells (n,): beginnings `every` so many seconds and lengths [s], both exponentially distributed."""
    spells, t = np.zeros(n, np.bool_), 0.0
    while t < n / COURSE:
        t += rng.exponential(every)
        lasts = rng.exponential(length)
        spells[round(t * COURSE) : round((t + lasts) * COURSE)] = True
        t += lasts
    return spells
