"""Healthy residuals of many kinds at 10 Hz and of unit size, drawn in pieces of any length."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from scipy.signal import lfilter

from recordings import Array

DT_S = 0.1
DAY_S = 86400.0

Draw = Callable[[int], Array]
"""The next so many samples."""

Family = Callable[[Generator], Draw]


def _ar(random: Generator, memory_s: float) -> Draw:
    """Correlated Gaussian noise of unit size (Ornstein and Uhlenbeck), with its memory."""
    keep = math.exp(-DT_S / memory_s)
    last = np.array([keep * random.normal()])

    def draw(n: int) -> Array:
        nonlocal last
        found, last = lfilter([math.sqrt(1.0 - keep**2)], [1.0, -keep], random.normal(size=n), zi=last)
        return np.asarray(found)

    return draw


def _scaled(one: Draw, size: Draw) -> Draw:
    return lambda n: np.asarray(one(n) * size(n), np.float64)


def _wandering(random: Generator, spread: float, memory_s: float) -> Draw:
    """A size whose logarithm wanders."""
    path = _ar(random, memory_s)
    return lambda n: np.asarray(np.exp(spread * path(n)), np.float64)


def _clock(random: Generator) -> Draw:
    """The time [s] from a random hour on."""
    now = DAY_S * random.random()

    def draw(n: int) -> Array:
        nonlocal now
        found = now + DT_S * np.arange(n, dtype=float)
        now += DT_S * n
        return found

    return draw


def _day(random: Generator) -> Draw:
    clock = _clock(random)
    return lambda n: np.asarray(1.0 + 0.3 * np.sin(2.0 * np.pi / DAY_S * clock(n)), np.float64)


def gaussian(random: Generator) -> Draw:
    """Independent and Gaussian."""
    return lambda n: random.normal(size=n)


def student(degrees: float) -> Family:
    """Student's t."""
    return lambda random: lambda n: random.standard_t(degrees, size=n)


def laplace(random: Generator) -> Draw:
    """Two-sided exponential."""
    return lambda n: random.laplace(size=n)


def skewed(random: Generator) -> Draw:
    """One-sided exponential, without its mean."""
    return lambda n: random.exponential(size=n) - 1.0


def correlated(memory_s: float) -> Family:
    """Gaussian with a memory."""
    return lambda random: _ar(random, memory_s)


def biased(random: Generator) -> Draw:
    """Gaussian with a bias that wanders by a tenth within an hour."""
    bias = _ar(random, 3600.0)
    return lambda n: random.normal(size=n) + 0.1 * bias(n)


def wandering(random: Generator) -> Draw:
    """A size that wanders by a quarter within twenty minutes."""
    return _scaled(gaussian(random), _wandering(random, 0.25, 1200.0))


def gusts(random: Generator) -> Draw:
    """A size that wanders by a half within thirty seconds."""
    return _scaled(gaussian(random), _wandering(random, 0.5, 30.0))


def daily(random: Generator) -> Draw:
    """A size that goes with the hour of the day."""
    return _scaled(gaussian(random), _day(random))


def outliers(random: Generator) -> Draw:
    """One sample in ten thousand is twenty times as large."""
    return lambda n: random.normal(size=n) * np.where(random.random(n) < 1e-4, 20.0, 1.0)


def quantised(step: float) -> Family:
    """In steps of so many sizes, around a centre between two of them."""

    def family(random: Generator) -> Draw:
        middle = step * random.random()
        return lambda n: step * np.round((random.normal(size=n) + middle) / step)

    return family


def beating(random: Generator) -> Draw:
    """Two sines of nearly the same period, and some noise."""
    clock = _clock(random)

    def draw(n: int) -> Array:
        t = clock(n)
        sines = np.sin(2.0 * np.pi * t / 14.0) + np.sin(2.0 * np.pi * t / 13.1)
        return np.asarray(sines + 0.3 * random.normal(size=n))

    return draw


def combined(random: Generator) -> Draw:
    """t4 with a memory of half a second, a wandering size, a day cycle and a bias."""
    keep, rest = 0.8, np.zeros(1)
    size, day, bias = _wandering(random, 0.25, 1200.0), _day(random), _ar(random, 3600.0)

    def draw(n: int) -> Array:
        nonlocal rest
        core, rest = lfilter([0.6], [1.0, -keep], random.standard_t(4.0, size=n), zi=rest)
        return np.asarray(core * size(n) * day(n) + 0.1 * bias(n))

    return draw


FAMILIES: dict[str, Family] = {
    "Gaussian": gaussian,
    "t4": student(4.0),
    "t3": student(3.0),
    "Laplace": laplace,
    "skewed": skewed,
    "outliers": outliers,
    "quantised 1": quantised(1.0),
    "quantised 4": quantised(4.0),
    "memory 2 s": correlated(2.0),
    "memory 30 s": correlated(30.0),
    "bias": biased,
    "wandering": wandering,
    "gusts": gusts,
    "day": daily,
    "beating": beating,
    "combined": combined,
}
