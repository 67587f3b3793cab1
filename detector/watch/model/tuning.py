"""The model of a valve tuned to the plant as it is, on fault-free data.

The identified model was fitted to other data, perhaps in other conditions. A few parameters are tuned on the balance of
forces where the stem slides steadily, by robust least squares: friction level, stiffness, preload, and what the process
pressures do to the stem. All others stay, and none may go far.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from detector.measurements import Measurements
from detector.observer.calibration_fit import NOISE_ORDER
from detector.watch.force_balance import sliding
from detector.watch.model.filter import Load, ModelFilter
from recordings import Array, BadInput, white_noise
from simulator import CATALOGUE, Catalogue, ValveModel

ROUNDS = 10
MOST_SAMPLES = 20_000
"""Tuning uses so many samples at most."""

HUBER = 1.345
"""A sample counts in full up to so many standard deviations: 95 % as good as least squares where all is Gaussian."""

PRESSURES = ("upstream_pressure", "downstream_pressure")

_BELIEF = (0.5, 0.2)
"""How far friction and stiffness may be from the model's: standard deviations of a prior, as shares."""

_AREA_BELIEF = 0.02
"""The same of the area on which a process pressure acts [m2]."""

AHEAD = 10.0
"""A stem that is so many noise levels ahead of where it was moves, beyond doubt."""


def filter_for(model: ValveModel, data: Measurements, catalogue: Catalogue = CATALOGUE) -> ModelFilter | None:
    """The filter of a model for the signals that are there; None when no force can be had from them.

    catalogue : where the model's effects are looked up. Raises BadInput for a model that a filter cannot follow.
    """
    effects = model.effects if "spring" in model.effects else (*model.effects, "spring")
    missing = [effect for effect in ("inertia", "lugre") if effect not in effects]
    if missing:
        raise BadInput("model", f"it has no {missing[0]}", "the detector needs a model with inertia and friction")
    area = model.plant.get("diaphragm_area_m2")
    if "force" in data:
        area, force = None, data.values["force"]
    elif "pressure" in data and isinstance(area, float | int):
        force = data.values["pressure"] * float(area)
    else:
        return None
    x = data.values["position"]
    values = {"spring.K": 0.0, "spring.F0": 0.0} | model.values
    noise = max(_least(model.noise.get("position_m"), white_noise(x[np.isfinite(x)], NOISE_ORDER)), 1e-9)
    measured, dt_s = white_noise(force[np.isfinite(force)], NOISE_ORDER), float(np.median(np.diff(data.time_s)))
    force_noise = max(_least(model.noise.get("force_N"), measured), 1e-3 * values["lugre.fc"])
    return ModelFilter(
        effects, values, None if area is None else float(area), noise, force_noise, 0.3 * noise, dt_s,
        _smoothing(x, dt_s, noise), _loads(data), catalogue,
    )  # fmt: skip


def tuned(filter: ModelFilter, data: Measurements) -> ModelFilter:
    """The filter with friction, preload, stiffness and loads tuned to data; as it was where the stem never slides."""
    part = data[:MOST_SAMPLES]
    rows = [
        (one.left, one.way * one.level, 1.0, filter.values["spring.K"] * one.position, *filter.shares(moment).tolist())
        for one, moment in zip(sliding(filter, part), part, strict=True)
        if one is not None
    ]
    if not rows:
        return filter
    left, shows = np.array(rows)[:, 0], np.array(rows)[:, 1:]
    alike = max(2.0 * filter.smoothing_s / filter.dt_s, 1.0)
    change: Array = np.zeros(shows.shape[1])
    for _ in range(ROUNDS):
        off = np.abs(left - shows @ change)
        scale = max(float(np.median(off)) / 0.6745, filter.force_noise / alike)
        weight = np.minimum(1.0, HUBER * scale / np.maximum(off, 1e-12)) / (alike * scale**2)
        information = (shows.T * weight) @ shows + np.diag(_prior(filter))
        change = np.asarray(np.linalg.solve(information, (shows.T * weight) @ left), np.float64)
    return _changed(filter, change)


def _prior(filter: ModelFilter) -> Array:
    """Inverse variances of friction, offset, stiffness and of the gains and slopes of the loads."""
    force = 5.0 * max(filter.values["lugre.fc"], 1.0)
    loads = [value for _ in filter.loads for value in (_AREA_BELIEF, _AREA_BELIEF / 0.01)]
    return 1.0 / np.array([_BELIEF[0], force, _BELIEF[1], *loads]) ** 2


def _changed(filter: ModelFilter, change: Array) -> ModelFilter:
    """The filter with levels changed: friction by a share, offset [N], stiffness by a share, loads."""
    friction, stiffness = (float(np.clip(1.0 + change[i], 0.5, 2.0)) for i in (0, 2))
    values = dict(filter.values)
    for name in ("lugre.fc", "lugre.fs"):
        values[name] *= friction
    values["spring.K"] *= stiffness
    values["spring.F0"] += float(change[1])
    loads = tuple(
        replace(load, gain=load.gain + float(change[3 + 2 * i]), slope=load.slope + float(change[4 + 2 * i]))
        for i, load in enumerate(filter.loads)
    )
    return replace(filter, values=values, loads=loads)


def _loads(data: Measurements) -> tuple[Load, ...]:
    """The process pressures that move by more than their noise."""
    found = []
    for name in PRESSURES:
        if name in data:
            p = data.values[name][np.isfinite(data.values[name])]
            if np.std(p) > 3.0 * white_noise(p, NOISE_ORDER):
                found.append(Load(name, float(np.mean(p)), float(np.nanmean(data.values["position"]))))
    return tuple(found)


def _smoothing(x: Array, dt_s: float, noise: float) -> float:
    """The shortest time in which a moving stem is well ahead of its noise [s], three samples at least."""
    for n in (3, 5, 8, 12, 20, 30, 50, 80, 120, 200):
        if n < len(x) // 4 and np.nanquantile(np.abs(x[n:] - x[:-n]), 0.75) > AHEAD * noise:
            return n * dt_s
    return max(3.0 * dt_s, 1.0)


def _least(given: float | None, measured: float) -> float:
    """Sensor noise: as the model has it, or as the data show, whichever is less; motion only adds to the latter."""
    return measured if given is None or given <= 0 else min(given, measured) if measured > 0 else given
