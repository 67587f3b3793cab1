"""What the force that a model does not account for depends on, and how much of it each quantity explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.tracing.models.model import Model
from identification.tracing.residual import quantities
from identification.tracing.result import TraceResult
from recordings import Array, IndexArray

BINS = 20
"""Bins of as many samples each, over which means are taken."""
SHOWS = 0.10
"""Share of the variance from which an effect shows in a picture. Noise alone stays below it: on recordings without a
missing effect the shares are up to 0.05 (`BINS` bins in either direction, adjusted for their number)."""
UNIT_DRAWN = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "1": (1.0, "")}
"""SI unit of a quantity -> factor and unit in which it is drawn; all others as they are."""


@dataclass(frozen=True)
class Dependence:
    """The residual force over one quantity. values [`unit`], force [N], rising : each (n_samples,), rising where the
    valve moves, or last moved, to higher positions; share : of the variance that the quantity explains, in either
    direction of travel; both : whether the two directions differ.
    """

    name: str
    unit: str
    values: Array
    force: Array
    rising: NDArray[np.bool_]
    share: float
    both: bool


def seen_models(trace: TraceResult) -> list[Model]:
    """The model before and, where something was added, the model after, on the recordings that show something."""
    models = [trace.selection.base, trace.selection.final][: 1 + bool(trace.effects_added)]
    return [model.on_held_out() for model in models] if trace.selection.only_held_out else models


def dependences(model: Model) -> list[Dependence]:
    """The residual force of a model over every quantity, that which explains most first."""
    force, known = np.concatenate(model.residual_force), quantities(model)
    rising = known["direction"].values > 0
    found = []
    for name, quantity in known.items():
        factor, unit = UNIT_DRAWN.get(quantity.unit, (1.0, quantity.unit))
        place = np.digitize(quantity.values, edges(quantity.values))
        together, apart = explained(force, place), explained(force, 2 * place + rising)
        both = apart > together + SHOWS / 2
        share = apart if both else together
        found.append(Dependence(name, unit, factor * quantity.values, force, rising, share, both))
    return sorted(found, key=lambda one: -one.share)


def residual_force(model: Model) -> tuple[float, float]:
    """Root mean square of the residual force [N], and of the same in standard deviations of the recorded force."""
    force, std = np.concatenate(model.residual_force), np.concatenate([grid.force.std for grid in model.data.fitted])
    return float(np.sqrt(np.mean(force**2))), float(np.sqrt(np.mean((force / std) ** 2)))


def edges(values: Array, parts: int = BINS) -> Array:
    """Inner edges of bins with as many samples each; fewer where values repeat."""
    return np.unique(np.quantile(values, np.linspace(0, 1, parts + 1)[1:-1]))


def explained(force: Array, place: IndexArray) -> float:
    """Share of the variance of a force (n_samples,) that the bins `place` (n_samples,) explain: the correlation ratio,
    adjusted for the number of bins (Kelley's epsilon squared).
    """
    _, bins, count = np.unique(place, return_inverse=True, return_counts=True)
    spread = float(np.sum((force - force.mean()) ** 2))
    if spread <= 0 or len(force) <= len(count):
        return 0.0
    within = float(np.sum((force - (np.bincount(bins, force) / count)[bins]) ** 2))
    return max(0.0, 1 - within / spread * (len(force) - 1) / (len(force) - len(count)))


def spectrum(model: Model) -> tuple[Array, Array, float]:
    """Frequencies [Hz] and amplitudes [N] of the residual force on the longest recording, and the share of its variance
    in the strongest line.
    """
    pairs = zip(model.data.fitted, model.residual_force, strict=True)
    grid, force = max(pairs, key=lambda pair: pair[0].t[-1])
    t = np.linspace(grid.t[0], grid.t[-1], len(grid.t))
    window = np.hanning(len(t))
    even = np.interp(t, grid.t, force)
    amplitude = 2 * np.abs(np.fft.rfft((even - even.mean()) * window)) / window.sum()
    power, peak = amplitude**2, int(np.argmax(amplitude))
    line = float(power[max(peak - 2, 0) : peak + 3].sum() / (power.sum() or 1.0))
    return np.fft.rfftfreq(len(t), t[1] - t[0])[1:], amplitude[1:], line
