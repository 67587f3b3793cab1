"""The largest mass that a recorded force can have moved as it was seen to move."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.data.experiment import Experiment, Segment
from recordings import Array

REST = 0.02
"""Time without motion [s] after which the stem is at rest, at least `FEWEST` samples: a vibration stops for less."""
FEWEST = 5
SURE = 5.0
"""Standard deviations of its noise that are taken off a velocity."""
OVERSHOOT = 1.25
"""A smoothed velocity overshoots before a stop, by some per cent."""


def largest_mass(experiments: Sequence[Experiment]) -> float:
    """The largest mass [kg] of a stem that the force can have moved so; infinite where it never starts from rest, or
    where the force is constant: then something else has moved it.

    What a stem has in motion it got since it last stood still, when friction, spring and force were in balance: from
    changes of the force, which are no larger than its range F [N], along its way d [m]. So m v^2/2 <= F d. Friction and
    spring only take from it, and a stop that it runs against takes all: the bound is a wide one. It keeps a fit that
    lacks an effect from a mass that explains slow motion better and no slip, whose few samples a robust cost gives up.
    """
    segments = [s for e in experiments for s in e.segments]
    force = float(np.ptp(np.concatenate([s.u for s in segments])))
    square = max(float(np.max(_square_over_way(s))) for s in segments)
    return 2 * OVERSHOOT * force / square if force > 0 and square > 0 else np.inf


def _square_over_way(s: Segment) -> Array:
    """The velocity's square over the way since the last rest, v^2/d [m/s2] (n_samples,); zero before the first rest."""
    n, i = max(round(REST / s.dt), FEWEST), np.arange(len(s.t))
    moves = np.cumsum(s.motion.crept != 0)
    still = (i >= n) & (moves == moves[np.maximum(i - n, 0)])
    last = np.maximum.accumulate(np.where(still, i, -1))
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(s.motion.x)))])
    way -= way[np.maximum(last, 0)]
    counts = (last >= 0) & (way > 0)
    noise = np.sqrt(np.mean(s.motion.v[still] ** 2)) if still.any() else 0.0
    speed = np.maximum(np.abs(s.motion.v) - SURE * noise, 0.0)
    return np.where(counts, speed**2 / np.where(counts, way, 1.0), 0.0)
