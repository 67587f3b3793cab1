"""How strongly a force answers the motion.

A positioner answers every slip, and a chamber fills while the stem moves: there the slope of the force changes more
than elsewhere, mostly by less than the noise of a sample tells. A force that is smoothed over such an answer is taken
for friction: behind a positioner, viscous friction came out at half of its value. All motion of a recording together
tells what a single slip does not: the share of the variance of the slope's steps that goes with the square of the way.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from identification.data.force import Force, with_intensity
from identification.data.smoothing import Motion
from recordings import Array

FEWEST = 10
"""Averages that tell something."""
BLOCK = 0.01
"""Time [s] over which samples are averaged, where they are closer: an answer lasts as long as a slip."""
ROUNDS = 60
"""Rounds of Fisher's scoring."""
CORNER = 9.0
"""Squares of steps beyond so many times what is expected count as so many: corners of a set point answer nothing."""
OF_MEANS, ALIKE = 11.0 / 20.0, 1.94
"""Variance of the step between two lines through three means of a force, over that of its slope in the time of one; and
variance of a mean square of such steps, over that of as many independent ones, where noise makes them."""


def answering(t: Array, u: Array, force: Force, motion: Motion) -> Force:
    """A force smoothed from u (n,) [N] at t (n,) [s], free to answer the motion as it does on average."""
    dt = np.diff(t)
    every = max(1, round(BLOCK / float(np.median(dt))))
    if len(t) < FEWEST * every:
        return force
    coarse_t, coarse_u, v = (_averaged(z, every) for z in (t, u, motion.v))
    apart, quiet = np.diff(coarse_t), float(np.median(force.intensity))
    share = answer(apart, coarse_u, force.noise / every**0.5, quiet, _way(v, apart))
    if share == 0.0:
        return force
    way = every * uniform_filter1d(_way(motion.crept, dt), every, mode="constant")
    near = maximum_filter1d(way, 2 * every + 1, mode="constant")  # an answer is late
    return with_intensity(t, u, force, np.maximum(force.intensity, share * near**2 / (every * dt)))


def answer(dt: Array, u: Array, noise: float, quiet: float, way: Array) -> float:
    """The variance [N2/s2] of a step of the slope of u (n,) over the square of the way [m2] that goes with it, from the
    ways (n - 1,) between samples: Fisher's scoring for a variance that has two components (Harville, JASA 72, 1977). 0
    where it is not larger than its standard error where nothing answers.

    noise : standard deviation of a sample [N]; quiet : intensity of what drives the slope besides [N2/s3].
    """
    first, last = 1 / dt[:-1], 1 / dt[1:]
    steps = np.diff(np.diff(u) / dt) ** 2
    other = noise**2 * (first**2 + last**2 + (first + last) ** 2) + OF_MEANS * quiet * dt[1:]
    square = np.maximum(way[1:], way[:-1]) ** 2
    if not square.any():
        return 0.0
    share = 0.0
    for _ in range(ROUNDS):
        expected = other + share * square
        excess = np.minimum(steps, CORNER * expected) - other
        share = max(float(np.sum(square * excess / expected**2) / np.sum(square**2 / expected**2)), 0.0)
    error = float(np.sqrt(2 * ALIKE / np.sum(square**2 / other**2)))
    return share / OF_MEANS if share > error else 0.0


def _averaged(values: Array, every: int) -> Array:
    """Means of so many values after another; what is left over is left out."""
    return np.asarray(values[: len(values) // every * every].reshape(-1, every).mean(axis=1), float)


def _way(v: Array, dt: Array) -> Array:
    """The way [m] in every interval (n - 1,) at velocities v (n,) [m/s]."""
    return np.abs(v[1:] + v[:-1]) / 2 * dt
