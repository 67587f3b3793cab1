"""A LuGre stem on its spring, from one controller output to the next: the valve of our physics.

Without a positioner the actuator fills with a lag, and the stem is at rest long before the next sample. So every sample
is given `HELD` seconds of the compiled physics, whatever its length. Behind a positioner OP is a set point, and the
positioner integrates until the stem breaks away: a sample is given its own length, but at most `LONGEST`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from recordings import Array
from simulator import BASE, PERIOD, Positioner, kernel

HELD, FILLING, SUB_STEP = 0.4, 0.08, 1.25e-3
"""Time of the physics for a sample, time constant of the actuator, and steps, which resolve a slip [s]."""
TIMES = np.linspace(0.0, HELD, 17)
LONGEST = 2.0
"""Time of the physics for a sample behind a positioner [s]."""
STROKE = 0.02
"""[m]"""


@dataclass
class StickingStem:
    """`move(op)` gives the position in % of the stroke for OP in %, both about their middle.

    values : of the base effects, SI units, with the spring's force counted from the middle of the stroke.
    """

    values: Mapping[str, float]
    _state: Array | None = field(default=None, repr=False)
    _force: float = field(default=0.0, repr=False)

    @classmethod
    def of(cls, s: float, j: float, rng: np.random.Generator) -> StickingStem:
        """A stem of friction S and J [% of OP]: S = 100 (fs + fc) / (K stroke), J = 100 (fs - fc) / (K stroke)."""
        K = float(10 ** rng.uniform(4.3, 5.0))
        full = K * STROKE
        values = {
            "mass.m": float(rng.uniform(2, 5)), "spring.K": K, "spring.F0": 0.0, "lugre.fc": (s - j) * full / 200,
            "lugre.fs": (s + j) * full / 200, "lugre.vs": float(10 ** rng.uniform(-3, -2)), "lugre.sigma0": 2e6,
            "lugre.sigma1": 1e3, "lugre.sigma2": float(rng.uniform(100, 1000)),
        }  # fmt: skip
        return cls(values)

    @property
    def full(self) -> float:
        """Force of the whole range of OP [N]."""
        return self.values["spring.K"] * STROKE

    def move(self, op: float) -> float:
        """The position for the next controller output."""
        valve = kernel(BASE, damped=True)
        wanted = self.full * op / 100
        force = wanted + (self._force - wanted) * np.exp(-TIMES / FILLING)
        state = valve.start(force=force[0]) if self._state is None else self._state
        p = valve.vector(self.values)
        self._state, self._force = valve.run(TIMES, force, p, state, h_max=SUB_STEP).final, float(force[-1])
        return 100 * float(self._state[0]) / STROKE


@dataclass
class PositionedStem:
    """The same stem behind the simulator's positioner: `move(op)` gives its position in % of the stroke for a set point
    in %, both about their middle. values : as of `StickingStem`; samples : of the positioner for one set point.
    """

    values: Mapping[str, float]
    samples: int
    _positioner: Positioner = field(repr=False)
    _state: Array = field(repr=False)

    @classmethod
    def of(cls, stem: StickingStem, dt: float) -> PositionedStem:
        """A stem at rest in its middle, with a set point every dt seconds."""
        positioner = Positioner.of(stem.values, STROKE, 0.0)
        return cls(stem.values, round(min(dt, LONGEST) / PERIOD), positioner, kernel(BASE, damped=True).start())

    def move(self, op: float) -> float:
        """The position for the next set point."""
        valve, times = kernel(BASE, damped=True), np.array([0.0, PERIOD])
        p, demand = valve.vector(self.values), STROKE * op / 100
        for _ in range(self.samples):
            force = self._positioner.force(demand, float(self._state[0]), PERIOD)
            self._state = valve.run(times, np.full(2, force), p, self._state, h_max=SUB_STEP, hold=True).final
        return 100 * float(self._state[0]) / STROKE
