"""What is known of the force between and behind its noisy samples, before any model of the valve is used.

The force is taken for the integral of a slope that is driven by white noise; where no model of the valve goes on from
there, as in a free run, for as many integrals as make it likeliest: a sine is smooth, a staircase is not. How strongly
differs along a recording (a rest, a ramp, a corner, a step), so the intensity is estimated locally by maximum
likelihood: MacKay's fixed point for hyperparameters (Neural Computation 4(3), 1992), over 20 ms where something happens
and over a second elsewhere. It has to be right at rest: a force that seems to quiver there makes a simulated bristle
creep, and the creep that is not seen in the position is then explained by too much break-away friction.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import resources
from types import ModuleType

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from recordings import Array
from simulator import native_module

EVENT, QUIET = 0.02, 1.0
"""Times over which the intensity is one [s]: about an event, and elsewhere."""
STANDS_OUT = 20.0
"""An event has an intensity so many times the median of its surroundings."""
ROUNDS, FASTEST = 8, 30.0
"""Rounds of the fixed point, and the largest factor on an intensity in one."""
STILL = 1e-3
"""Least wander of the force in a second, in standard deviations of a sample."""
ORDER, SMOOTH = 2, 4
"""Integrals of the white noise: those that a model of a force with error has, and those of a smooth force."""
LEAST = 1e-12
"""Least variance of a smoothed force, in those of a sample."""
DECADES = {ORDER: np.arange(-2.0, 16.0), SMOOTH: np.arange(-2.0, 23.0, 2.0)}
"""Intensities that are tried first, in powers of ten of the noise variance per s^(2 order - 1)."""


@dataclass(frozen=True)
class Force:
    """u (n,) smoothed force [N], slope (n,) [N/s], std (n,) its standard deviation [N]; intensity (n - 1,) [N2/s3] of
    the noise that drives the slope; noise [N] of the samples; likelihood of two integrals : logarithm, but for a
    constant.
    """

    u: Array
    slope: Array
    std: Array
    intensity: Array
    noise: float
    likelihood: float


def recursions_text() -> tuple[str, str]:
    """The text of `recursions.py`: the steps of any filter, and the smoother of a force that follows on them."""
    text = resources.files("identification.data").joinpath("recursions.py").read_text("utf-8")
    steps, _, rest = text.partition("# The force\n")
    return steps, rest


@functools.cache
def loops() -> ModuleType:
    """The compiled `smoothed_force` of `recursions.py`."""
    return native_module("force", "".join(recursions_text()))


def estimate_force(t: Array, u: Array, noise: float) -> Force:
    """Smooth the force u (n,) [N] recorded at t (n,) [s] with a noise of standard deviation `noise` [N].

    The standard deviations hold within about a tenth on forces made of ramps, sines and steps.
    """
    mean, std, intensity, likelihood = chain(t, u, noise, ORDER)
    return Force(mean[:, 0].copy(), mean[:, 1].copy(), std, intensity, noise, likelihood)


def with_intensity(t: Array, u: Array, force: Force, intensity: Array) -> Force:
    """A force smoothed from u (n,) [N] at t (n,) [s] with another intensity (n - 1,) of what drives it."""
    mean, std, _ = _known(t, u, intensity, force.noise, ORDER, False)
    return replace(force, u=mean[:, 0].copy(), slope=mean[:, 1].copy(), std=std, intensity=intensity)


def smoother_force(t: Array, u: Array, force: Force) -> Array | None:
    """The force (n,) [N] by more integrals, recorded as for `estimate_force`; None where two are likelier."""
    mean, _, _, likelihood = chain(t, u, force.noise, SMOOTH)
    return mean[:, 0].copy() if likelihood > force.likelihood else None


def chain(t: Array, z: Array, noise: float, order: int, *, moving: bool = False) -> tuple[Array, Array, Array, float]:
    """A signal z (n,) as so many integrals of white noise: it and its derivatives (n, order), its standard deviation
    (n,), the intensity (n - 1,) of the noise that drives it, and the likelihood. noise : standard deviation of z;
    moving : it starts as its first samples say, and not about at rest.
    """
    r, dt = noise**2, np.diff(t)

    def even(decade: float) -> Array:
        return np.full(len(dt), r * 10.0**decade)

    intensity = even(_likeliest(DECADES[order], lambda decade: _pass(t, z, even(decade), noise, order, moving)[3]))
    least = (2 * order - 1) * math.factorial(order - 1) ** 2 * r * STILL**2
    for _ in range(ROUNDS):
        mean, _, jumps, _ = _pass(t, z, intensity, noise, order, moving)
        intensity = np.maximum(_updated(intensity, dt, np.diff(mean[:, -1]) ** 2, jumps), least)
    mean, std, likelihood = _known(t, z, intensity, noise, order, moving)
    return mean, std, intensity, likelihood


def _likeliest(decades: Array, likelihood: Callable[[float], float]) -> float:
    """The decade with the largest likelihood, which has one peak: the best of every other one, or one beside it."""
    known = functools.cache(likelihood)
    best = int(np.argmax([known(d) for d in decades[::2]])) * 2
    return float(max(decades[max(best - 1, 0) : best + 2], key=known))


def smoothed(t: Array, z: Array, intensity: Array, noise: float, order: int) -> Array:
    """The signal z (n,), which moves from the first, and its derivatives (n, order) where the intensity (n - 1,) is
    known.
    """
    return _pass(t, z, intensity, noise, order, True)[0]


def _known(
    t: Array, z: Array, intensity: Array, noise: float, order: int, moving: bool
) -> tuple[Array, Array, float]:  # fmt: skip
    """What the smoother knows: mean (n, order), standard deviation (n,) and the likelihood."""
    mean, variance, _, likelihood = _pass(t, z, intensity, noise, order, moving)
    return mean, np.sqrt(np.maximum(variance, LEAST * noise**2)), likelihood


def _pass(
    t: Array, z: Array, intensity: Array, noise: float, order: int, moving: bool
) -> tuple[Array, Array, Array, float]:
    """One pass of the smoother: mean (n, order), variance (n,), squares of the last state's steps (n - 1,), and the
    likelihood.
    """
    mean, variance, jumps, start = np.empty((len(t), order)), np.empty(len(t)), np.empty(len(t) - 1), np.zeros(order)
    start[: order if moving else 1] = [np.diff(z[: order + 1], i)[0] for i in range(order if moving else 1)]
    likelihood = loops().smoothed_force(t, z, intensity, noise**2, start, mean, variance, jumps)
    return mean, variance, jumps, float(likelihood)


def _updated(intensity: Array, dt: Array, steps: Array, jumps: Array) -> Array:
    """One round for the intensities (n - 1,) from the squares of the smoothed slope's steps, and their expectations."""
    spacing = float(np.median(dt))
    event, quiet = (max(3, round(time / spacing) | 1) for time in (EVENT, QUIET))
    determined = uniform_filter1d(dt - (jumps - steps) / intensity, event, mode="nearest")  # share the data decide
    local = uniform_filter1d(steps, event, mode="nearest") / np.maximum(determined, 1e-3 * dt)
    local = np.clip(local, intensity / FASTEST, intensity * FASTEST)
    stride = max(1, event // 6)
    coarse = median_filter(local[::stride], max(3, quiet // stride | 1), mode="nearest")
    around = np.interp(np.arange(len(local)), np.arange(len(coarse)) * stride, coarse)
    return np.asarray(np.where(local > STANDS_OUT * around, local, around), float)
