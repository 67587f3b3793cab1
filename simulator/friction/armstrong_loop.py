"""The loop of `simulate_drive`, compiled by numba: symplectic Euler, with the two regimes as one state machine."""

from __future__ import annotations

import numpy as np

from simulator.hysteresis.masing import native


@native
def run(reference, step, model, drive, start, out):  # type: ignore[no-untyped-def]
    """Fill out (5, n_samples): x, v, force, friction, sticking."""
    coulomb, viscous, ultimate, stiffness, speed, memory, rise, damping = model
    mass, spring, damper, integral = drive
    x, v, area = start[0], start[1], 0.0
    late = np.zeros(round(memory / step) + 1)
    late[:] = v
    sticking, way, place, rest = v == 0.0, 1.0 if v >= 0 else -1.0, x, 1e9
    arrived = level = ultimate  # Stribeck friction at the last arrival and at the last break-away
    for k in range(len(reference)):
        error = reference[k] - x
        pace = (reference[k + 1] - reference[k]) / step if k + 1 < len(reference) else 0.0
        force = spring * error + damper * (pace - v) + area
        area += integral * error * step
        late[k % len(late)] = v
        then = late[(k + 1) % len(late)]  # the oldest: the velocity a time `memory` ago
        if sticking:
            friction = -stiffness * (x - place) - damping * v
            share = rest / (rest + rise) if rise > 0 else 1.0
            most = coulomb + arrived + (ultimate - arrived) * share
            if abs(stiffness * (x - place)) > most:
                sticking, way = False, 1.0 if x > place else -1.0
                level = most - coulomb
        if not sticking:
            friction = -way * (coulomb + level / (1 + (then / speed) ** 2)) - viscous * v
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = x, v, force, friction, 1.0 if sticking else 0.0
        v += step * (force + friction) / mass
        x += step * v
        rest += step
        if not sticking and v * way < 0:  # it turns: the contact takes over at the same force
            arrived = level / (1 + (then / speed) ** 2)
            place, rest, sticking = x - way * (coulomb + arrived) / stiffness, 0.0, True
