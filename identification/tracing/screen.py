"""Which effects could explain what is left: a score test of every candidate at its neutral strength.

At the fitted base, the derivatives by the strength of a candidate say how far the cost would fall to first order if it
were added and everything refitted (Rao's score test). Shapes that a strength of zero does not show (the place of a
tight spot, the frequency of a disturbance) are scanned.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from identification.estimators.least_squares import Normal
from identification.tracing.model import RESTED, Model, TrialData
from recordings import Array
from simulator import CATALOGUE, Parameter, TriedAt

PLACES = (0.15, 0.35, 0.5, 0.65, 0.85)
"""Places along the travel at which local effects are tried, as shares of it."""
WIDTHS = (0.06, 0.2)
"""Their half widths, likewise."""
FARTHEST, LEAST = 3.0, 0.05
"""A refit starts with a strength at most, and one that can only grow at least, so many of its scales from neutral."""
PEAKS = 3
"""Frequencies and pitches that are tried, the strongest in what is left of the force."""


@dataclass(frozen=True)
class Score:
    """An effect at its best shape. gain : fall of the cost to first order; values : parameters by full name with the
    strength where that fall is expected.
    """

    effect: str
    gain: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class Rhythms:
    """Frequencies [Hz] and pitches [m] that stand out in what is left of the force."""

    frequencies: list[float]
    pitches: list[float]


def screen(base: Model) -> list[Score]:
    """The scores of all candidates that the base does not have, best first."""
    candidates = [e for e in base.data.candidates if e not in base.effects]
    rhythms = rhythms_of(base)
    thin = base.thinned()
    share = base.data.samples / thin.data.samples
    found = [best(thin, effect, rhythms) for effect in candidates]
    found = [s if s is None else Score(s.effect, s.gain * share, s.values) for s in found]
    return sorted((s for s in found if s is not None), key=lambda s: -s.gain)


def rhythms_of(base: Model) -> Rhythms:
    """The rhythms in what a model leaves of the force."""
    return Rhythms(_frequencies(base), _pitches(base))


def best(base: Model, effect: str, rhythms: Rhythms) -> Score | None:
    """The best shape of one effect; None when it leaves no trace at all."""
    scores = [score(base, effect, shape) for shape in shapes(base, effect, rhythms)]
    known = [s for s in scores if s is not None]
    return max(known, key=lambda s: s.gain) if known else None


def score(base: Model, effect: str, shape: Mapping[str, float]) -> Score | None:
    """The score of an effect with its shape given.

    A strength that can only grow from zero is also tried at some sizes: a play operator at rest on noise shows
    nothing to first order.
    """
    found = [_score(base, effect, shape, trial) for trial in ({}, *_trials(effect, base.data))]
    known = [one for one in found if one is not None]
    return max(known, key=lambda one: one.gain) if known else None


def _trials(effect: str, data: TrialData) -> list[dict[str, float]]:
    """Sizes at which to try the strengths of an effect: multiples of the noise or shares of the scale."""
    noise, found = data.fitted[0].noise_y, list[dict[str, float]]()
    for name, p in strengths(effect).items():
        if p.tried_at is TriedAt.NOISE:
            found += [{name: size} for size in (4 * noise, 16 * noise)]
        elif p.tried_at is TriedAt.SHARES:
            found += [{name: size} for size in (0.1 * p.scale, 0.5 * p.scale)]
    return found


def strengths(effect: str) -> dict[str, Parameter]:
    """The parameters that vanish with the effect, by full name."""
    e = CATALOGUE[effect]
    return {e.parameter_name(p.symbol): p for p in e.parameters if p.neutral is not None}


def _score(base: Model, effect: str, shape: Mapping[str, float], trial: Mapping[str, float]) -> Score | None:
    """The score about the neutral strengths, or about a trial of them."""
    model = base.with_effect(effect, {**shape, **trial}, steps=RESTED if trial else 0)
    if model is None:
        return None
    normal, sizes, names = model.estimate.normal, strengths(effect), model.coordinates.free_names
    own = CATALOGUE[effect].parameter_names()
    seen = np.diag(normal.matrix) > 1e-12 * np.diag(normal.matrix).max()
    added = np.array([name in sizes for name in names]) & seen
    old = np.array([name not in own for name in names]) & seen
    if not added.any():
        return None
    move, gain = promised(normal, added | old)
    gain += base.rested_cost - model.estimate.cost if trial else -promised(normal, old)[1]
    values = {name: value for name, value in model.values.items() if name in own}
    for i in np.flatnonzero(added):
        parameter = sizes[names[i]]
        step = float(np.clip(move[i], -FARTHEST, FARTHEST))
        if parameter.lower == parameter.neutral and step <= 0 and not trial:
            gain, step = 0.0, LEAST
        values[names[i]] = float(np.clip(values[names[i]] + step * parameter.scale, parameter.lower, parameter.upper))
    return Score(effect, max(gain, 0.0), values)


def promised(normal: Normal, chosen: NDArray[np.bool_] | None = None) -> tuple[Array, float]:
    """The Gauss-Newton move in the chosen coordinates, or in all, and the fall of the cost it promises."""
    matrix, gradient = normal.matrix, normal.gradient
    chosen = np.ones(len(gradient), np.bool_) if chosen is None else chosen
    scale = np.sqrt(np.maximum(np.diag(matrix)[chosen], 1e-300))
    inner = matrix[np.ix_(chosen, chosen)] / np.outer(scale, scale)
    move = np.zeros(len(gradient))
    move[chosen] = -np.linalg.lstsq(inner, gradient[chosen] / scale, rcond=1e-9)[0] / scale
    return move, float(-gradient @ move)


def shapes(base: Model, effect: str, rhythms: Rhythms) -> Iterator[dict[str, float]]:
    """The shapes at which an effect is tried, as parameter values by full name."""
    axes = {
        CATALOGUE[effect].parameter_name(p.symbol): _axis(p, base, rhythms)
        for p in CATALOGUE[effect].parameters
        if p.neutral is None and not p.known
    }
    for choice in itertools.product(*axes.values()):
        yield dict(zip(axes, choice, strict=True))


def _axis(parameter: Parameter, base: Model, rhythms: Rhythms) -> list[float]:
    """Values at which one shape parameter is tried."""
    data = base.data
    if parameter.tried_at is TriedAt.FREQUENCIES:
        return rhythms.frequencies or [parameter.scale]
    if parameter.tried_at is TriedAt.PITCHES:
        return rhythms.pitches or [parameter.scale]
    if parameter.tried_at is TriedAt.POSITIONS:
        return [data.travel[0] + share * data.stroke for share in PLACES]
    if parameter.tried_at is TriedAt.WIDTHS:
        return [share * data.stroke for share in WIDTHS]
    return [parameter.scale]


def _frequencies(base: Model) -> list[float]:
    """The strongest frequencies [Hz] in what is left, above three periods of the longest grid."""
    left = base.force_left
    longest = max(range(len(left)), key=lambda i: base.data.fitted[i].t[-1])
    t = base.data.fitted[longest].t
    grid = np.linspace(t[0], t[-1], len(t))
    signal = np.interp(grid, t, left[longest])
    power: Array = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(len(signal)))) ** 2
    f: Array = np.fft.rfftfreq(len(grid), grid[1] - grid[0])
    return _strongest(f, power, (f > 3 / (t[-1] - t[0])) & (f < 40.0))


def _pitches(base: Model) -> list[float]:
    """The strongest periods [m] of what is left along the travel."""
    data = base.data
    bins = 512
    edges = np.linspace(*data.travel, bins + 1)
    x = np.concatenate([path[:, 0] for path in base.estimate.paths])
    moving = np.concatenate([np.abs(path[:, 1]) for path in base.estimate.paths]) > 1e-4
    force = np.concatenate(base.force_left)
    place = np.clip(np.digitize(x[moving], edges) - 1, 0, bins - 1)
    count = np.bincount(place, minlength=bins)
    mean = np.bincount(place, force[moving], minlength=bins) / np.maximum(count, 1)
    mean -= mean[count > 0].mean() if (count > 0).any() else 0.0
    power: Array = np.abs(np.fft.rfft(np.where(count > 0, mean, 0.0) * np.hanning(bins), 4 * bins)) ** 2
    k = np.asarray(np.fft.rfftfreq(4 * bins, data.stroke / bins), float)
    return [1 / f for f in _strongest(k, power, (k > 1.5 / data.stroke) & (k < 100 / data.stroke))]


def _strongest(f: Array, power: Array, allowed: NDArray[np.bool_]) -> list[float]:
    peaks, _ = find_peaks(np.where(allowed, np.asarray(power, float), 0.0))
    return [float(f[i]) for i in sorted(peaks, key=lambda i: -power[i])[:PEAKS]]
