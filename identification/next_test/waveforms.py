"""Families of test sequences, each a curve of few numbers between 0 and 1, so that a search can bend it.

A waveform gives a demand (n_samples,) within 0 and 1, the ends of what may be asked of the valve, for times from 0 to
1, the length of the test, and a shape (3,) of numbers from 0 to 1. What the shape means is said by each family.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from recordings import Array

Waveform = Callable[[Array, Array], Array]
SHAPE = 3
"""Numbers that a shape has."""
PER_PERIOD = 20
"""Samples of the quickest period: what is quicker, a fit takes for noise of the force."""
GOLDEN = 0.6180339887498949


def steps(time: Array, shape: Array) -> Array:
    """Levels with dwells. shape : number of levels from 4 to 40, range of the levels, their centre."""
    levels = round(_between(4, 40, shape[0]))
    level = GOLDEN * (1 + np.minimum((time * levels).astype(int), levels - 1)) % 1.0
    return _within(level, shape[1], shape[2])


def ramps(time: Array, shape: Array) -> Array:
    """Ramps with reversals that wander. shape : reversals from 2 to 60, their size, how far they wander."""
    swings = min(round(_between(2, 60, shape[0])) / 2, _most(time))
    triangle = 1 - np.abs(2 * (time * swings % 1.0) - 1)
    size = _between(0.05, 1.0, shape[1])
    centre = 0.5 + (1 - size) * shape[2] * (np.abs(2 * (2 * time % 1.0) - 1) - 0.5)
    return np.asarray(np.clip(centre + size * (triangle - 0.5), 0.0, 1.0), float)


def multisine(time: Array, shape: Array) -> Array:
    """Sines, Schroeder-phased (IEEE TIT 16, 1970). shape : highest line from 3 to 120, range, centre."""
    lines = np.arange(1, min(round(_between(3, 120, shape[0])), _most(time)) + 1)
    chosen = np.unique(np.round(np.geomspace(lines[0], lines[-1], min(20, len(lines)))).astype(int))
    number = np.arange(1, len(chosen) + 1)
    phases = -np.pi * number**2 / len(chosen)
    signal = np.cos(2 * np.pi * np.outer(time, chosen) + phases).sum(axis=1)
    return _within(0.5 + 0.5 * signal / np.abs(signal).max(), shape[1], shape[2])


def reversals(time: Array, shape: Array) -> Array:
    """Small reversals at several places. shape : places from 2 to 8, size of a reversal, reversals at a place."""
    places = round(_between(2, 8, shape[0]))
    size, each = _between(0.01, 0.4, shape[1]), round(_between(2, 12, shape[2]))
    each = max(min(each, _most(time) // places), 1)
    at = np.minimum((time * places).astype(int), places - 1)
    inside = time * places - at
    centre = size / 2 + (1 - size) * (GOLDEN * (1 + at) % 1.0)
    shaken = np.clip((inside - 0.2) / 0.8, 0.0, 1.0)  # a fifth of the time to come there, and to rest
    return np.asarray(centre + size / 2 * np.sin(2 * np.pi * each * shaken), float)


def _most(time: Array) -> int:
    """Periods that so many samples resolve."""
    return max(len(time) // PER_PERIOD, 1)


def _between(low: float, high: float, share: float) -> float:
    """A number between two by its share of their ratio."""
    return float(low * (high / low) ** share)


def _within(wave: Array, size: float, centre: float) -> Array:
    """A wave between 0 and 1 in a part of the range. size : 0 for a tenth of it, 1 for all; centre : 0 low, 1 high."""
    span = 0.1 + 0.9 * size
    return np.asarray((1 - span) * centre + span * wave, float)


WAVEFORMS: Mapping[str, Waveform] = {
    "steps with dwells": steps, "ramps with reversals": ramps, "multisine": multisine,
    "small reversals at several places": reversals,
}  # fmt: skip
"""The families by name. A new one is a function and its place here."""


def staircase(time: Array) -> Array:
    """Ten levels over the whole range, to compare with."""
    return steps(time, np.array([np.log(10 / 4) / np.log(10), 1.0, 0.5]))


def sine(time: Array) -> Array:
    """Four periods over the whole range, to compare with."""
    return np.asarray(0.5 - 0.5 * np.cos(8 * np.pi * time), float)


REFERENCES: Mapping[str, Callable[[Array], Array]] = {"staircase": staircase, "sine": sine}
"""What a proposal is compared with: tests of the same length that everybody runs."""
