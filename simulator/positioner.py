"""A sampled PI positioner that moves a valve to a demand."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from recordings import Array
from simulator.compile.kernel import Kernel
from simulator.excitation import HIGH

PERIOD = 0.02
"""Time between two samples of the positioner [s]."""
FILTER = 0.1
"""Time constant of the positioner's filter [s]."""
SUPPLY = 1e3
"""Force that the supply has beyond what the spring needs over the stroke [N]."""
GAIN, RESET = 0.8, 0.5
"""Gain in forces of the spring, and integral time [s]."""


@dataclass
class Positioner:
    """The law of the positioner, stepped sample by sample: PI on the filtered error, or it would ring with the mass on
    its spring, with a force that the supply limits.

    spring : force that a travel is taken to need [N/m]; limits : of the force [N]; follow : share of the error's change
    that its filter lets through in one sample; integral [N] and error [m], filtered : its state.
    """

    spring: float
    limits: tuple[float, float]
    follow: float
    integral: float
    error: float = 0.0

    @classmethod
    def of(cls, values: Mapping[str, float], stroke: float, start: float, period: float = PERIOD) -> Positioner:
        """For a valve whose parameters are `values` by full name, that rests at `start` [m] of its stroke [m]; period :
        between two samples [s].
        """
        spring = values.get("spring.K", 0.0) or values.get("lugre.fs", 100.0) / (0.05 * stroke)
        rest = values.get("spring.F0", 0.0) + spring * start
        limits = rest - spring * stroke - SUPPLY, rest + spring * (HIGH + 1) * stroke + SUPPLY
        return cls(spring, limits, 1.0 - float(np.exp(-period / FILTER)), rest)

    def force(self, demand: float, seen: float, held: float) -> float:
        """The force [N] for a demand and a measured position [m], which is held for so long [s]."""
        (low, high), self.error = self.limits, self.error + self.follow * (demand - seen - self.error)
        proportional = GAIN * self.spring * self.error
        self.integral = min(max(self.integral + proportional * held / RESET, low), high)
        return min(max(self.integral + proportional, low), high)


def positioned(
    valve: Kernel,
    p: Array,
    values: Mapping[str, float],
    t: Array,
    demand: Array,
    *,
    stroke: float,
    start: float,
    h_max: float,
) -> tuple[Array, Array]:
    """Force [N] and position [m], each (n_samples,), of a valve that a positioner moves to a demand [m] (n_samples,).

    The force is what the `Positioner` commands, held from sample to sample.

    p : parameters in the order of the kernel, and `values`, the same by full name; t [s]; stroke [m]; start : position
    [m] at which the valve rests at first; h_max : longest sub-step [s].
    """
    period, delay = max(1, round(PERIOD / (t[1] - t[0]))), values.get(valve.layout.delay, 0.0)
    memory = math.ceil(delay / (t[1] - t[0])) + 1
    force, position = np.empty(len(t)), np.empty(len(t))
    positioner = Positioner.of(values, stroke, start, period * float(t[1] - t[0]))
    state, seen = valve.start(start, force=positioner.integral), start
    for first in range(0, len(t), period):
        last = min(first + period, len(t) - 1)
        commanded = positioner.force(float(demand[first]), seen, float(t[last] - t[first]))
        force[first : last + 1] = commanded
        block, back = slice(first, last + 1), max(0, first - memory)
        given = valve.inputs(t[back : last + 1], force[back : last + 1], p, hold=True)[first - back :]
        run = valve.run(t[block], given, p, state, h_max=h_max, hold=True)
        position[block], state, seen = run.outputs[:, 0], run.final, float(run.outputs[-1, 0])
    return force, position
