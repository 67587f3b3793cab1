"""A sampled PI positioner that moves a valve to a demand."""

from __future__ import annotations

import math
from collections.abc import Mapping

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

    The force is what the positioner commands, held from sample to sample. It filters the measured position, or it would
    ring with the mass on its spring; its supply limits the force.

    p : parameters in the order of the kernel, and `values`, the same by full name; t [s]; stroke [m]; start : position
    [m] at which the valve rests at first; h_max : longest sub-step [s].
    """
    spring = values.get("spring.K", 0.0) or values.get("lugre.fs", 100.0) / (0.05 * stroke)
    period, delay = max(1, round(PERIOD / (t[1] - t[0]))), values.get(valve.layout.delay, 0.0)
    memory = math.ceil(delay / (t[1] - t[0])) + 1
    force, position = np.empty(len(t)), np.empty(len(t))
    integral = values.get("spring.F0", 0.0) + spring * start
    state, seen = valve.start(start, force=integral), start
    limits = integral - spring * stroke - SUPPLY, integral + spring * (HIGH + 1) * stroke + SUPPLY
    error, follow = 0.0, 1.0 - np.exp(-period * (t[1] - t[0]) / FILTER)
    for first in range(0, len(t), period):
        last = min(first + period, len(t) - 1)
        error += follow * (demand[first] - seen - error)
        integral = float(np.clip(integral + 0.8 * spring * error * (t[last] - t[first]) / 0.5, *limits))
        force[first : last + 1] = np.clip(integral + 0.8 * spring * error, *limits)
        block, back = slice(first, last + 1), max(0, first - memory)
        given = valve.inputs(t[back : last + 1], force[back : last + 1], p, hold=True)[first - back :]
        run = valve.run(t[block], given, p, state, h_max=h_max, hold=True)
        position[block], state, seen = run.outputs[:, 0], run.final, run.outputs[-1, 0]
    return force, position
