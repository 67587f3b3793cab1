"""The values at which the parameters of an effect are tried before it is fitted, as each of them declares."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from identification.tracing import settings
from identification.tracing.models.model import Model
from identification.tracing.models.trial_data import TrialData
from recordings import Array
from simulator import Parameter, TriedAt

BINS, PADDING, FEWEST_BINS = 512, 4, 5
"""Bins along the travel in which the residual force is averaged to find pitches, the factor by which their spectrum is
interpolated to place its peaks, and the bins of the shortest pitch."""
AT_REST = 0.01
"""Speed below which a valve rests, as a share of its root mean square speed."""


def slides(v: Array) -> NDArray[np.bool_]:
    """Where velocities (n,) are those of a valve that moves: at rest friction holds any force."""
    return np.asarray(np.abs(v) > AT_REST * float(np.sqrt(np.mean(v**2))))


@dataclass(frozen=True)
class Rhythms:
    """Frequencies [Hz] and pitches [m] that stand out in the residual force, the strongest first."""

    frequencies: list[float]
    pitches: list[float]


def rhythms(model: Model) -> Rhythms:
    """The rhythms in the residual force of a model."""
    return Rhythms(_frequencies(model), _pitches(model))


def shapes(data: TrialData, effect: str, found: Rhythms) -> Iterator[dict[str, float]]:
    """The shapes at which an effect is tried, as parameter values by full name."""
    one = data.catalogue[effect]
    axes = {
        one.parameter_name(p.symbol): _axis(p, data, found) for p in one.parameters if p.neutral is None and not p.known
    }
    for choice in itertools.product(*axes.values()):
        yield dict(zip(axes, choice, strict=True))


def strengths(data: TrialData, effect: str) -> dict[str, Parameter]:
    """The parameters that vanish with an effect, by full name."""
    one = data.catalogue[effect]
    return {one.parameter_name(p.symbol): p for p in one.parameters if p.neutral is not None}


def sizes(data: TrialData, effect: str) -> Iterator[dict[str, float]]:
    """The sizes beside zero at which the strengths of an effect are tried, by full name."""
    noise = data.fitted[0].noise_y
    for name, p in strengths(data, effect).items():
        if p.tried_at is TriedAt.NOISE:
            yield from ({name: multiple * noise} for multiple in settings.NOISE_MULTIPLES)
        elif p.tried_at is TriedAt.SHARES:
            yield from ({name: share * p.scale} for share in settings.SCALE_SHARES)


def _axis(parameter: Parameter, data: TrialData, found: Rhythms) -> list[float]:
    """The values of one shape parameter."""
    if parameter.tried_at is TriedAt.FREQUENCIES:
        return found.frequencies or [parameter.scale]
    if parameter.tried_at is TriedAt.PITCHES:
        return found.pitches or [parameter.scale]
    if parameter.tried_at is TriedAt.POSITIONS:
        return [data.travel[0] + share * data.stroke for share in settings.POSITIONS]
    if parameter.tried_at is TriedAt.WIDTHS:
        return [share * data.stroke for share in settings.WIDTHS]
    return [parameter.scale]


def _frequencies(model: Model) -> list[float]:
    """The strongest frequencies [Hz] of the residual force of the longest recording."""
    force = model.residual_force
    longest = max(range(len(force)), key=lambda i: model.data.fitted[i].t[-1])
    t = model.data.fitted[longest].t
    even = np.linspace(t[0], t[-1], len(t))
    signal = np.interp(even, t, force[longest])
    power: Array = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(len(signal)))) ** 2
    f: Array = np.fft.rfftfreq(len(even), even[1] - even[0])
    return _strongest(f, power, (f > settings.MIN_PERIODS / (t[-1] - t[0])) & (f < settings.MAX_FREQUENCY))


def _pitches(model: Model) -> list[float]:
    """The strongest periods [m] of the residual force along the travel, by its mean over bins of the position."""
    data, bins = model.data, BINS
    edges = np.linspace(*data.travel, bins + 1)
    x = np.concatenate([path[:, 0] for path in model.estimate.paths])
    moving = np.concatenate([slides(path[:, 1]) for path in model.estimate.paths])
    force = np.concatenate(model.residual_force)
    place = np.clip(np.digitize(x[moving], edges) - 1, 0, bins - 1)
    count = np.bincount(place, minlength=bins)
    mean = np.bincount(place, force[moving], minlength=bins) / np.maximum(count, 1)
    mean -= mean[count > 0].mean() if (count > 0).any() else 0.0
    padded = PADDING * bins
    power: Array = np.abs(np.fft.rfft(np.where(count > 0, mean, 0.0) * np.hanning(bins), padded)) ** 2
    k = np.asarray(np.fft.rfftfreq(padded, data.stroke / bins), float)
    allowed = (k > settings.MIN_PERIODS / data.stroke) & (k < bins / FEWEST_BINS / data.stroke)
    return [1 / f for f in _strongest(k, power, allowed)]


def _strongest(f: Array, power: Array, allowed: NDArray[np.bool_]) -> list[float]:
    """The frequencies of the strongest peaks of a spectrum, of those that are allowed."""
    peaks, _ = find_peaks(np.where(allowed, np.asarray(power, float), 0.0))
    return [float(f[i]) for i in sorted(peaks, key=lambda i: -power[i])[: settings.PEAKS]]
