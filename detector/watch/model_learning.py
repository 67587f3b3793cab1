"""The model of a valve brought to the plant as it is: levels trimmed, loads and limits learned, on fault-free data.

The identified model was fitted to other data, perhaps in other conditions. A few parameters are trimmed by Gauss and
Newton on the innovation (friction level, stiffness, preload, and what the process pressures do to the stem); all others
stay, and none may go far. Then the sums of the tests are run over the same data, and their limits follow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from detector.alarms.rates import Blocks, least_limit, strokes_of
from detector.observer.calibration import MARGIN, noise_of
from detector.watch.innovation import DIRECTIONS, Innovation, Load, ModelFilter
from detector.watch.measurements import Measurements
from detector.watch.sequential import ChangeTest, N
from recordings import Array, BadInput
from simulator import ValveModel

ROUNDS = 4
MOST_SAMPLES = 20_000
"""The trim looks at so many samples at most."""

PRESSURES = ("upstream_pressure", "downstream_pressure")

_FRICTION, _SPRING, _OFFSET, _STIFFNESS = range(4)
_BELIEF = (0.5, 0.2)
"""How far friction and stiffness may be from the model's: standard deviations of a prior, as shares."""

_AREA_BELIEF = 0.02
"""The same of the area on which a process pressure acts [m2]."""

LEAST_SIZES = (0.5, 0.1, 0.5)
"""Changes that are tested for: half of the friction, a tenth of the spring, a force of half the friction level."""

AHEAD = 10.0
"""A stem that is so many noise levels ahead of where it was moves, beyond doubt."""

SKIPPED = 50
"""Samples after a start that are not learned from."""


@dataclass(frozen=True)
class Innovations:
    """A run of the filter: value, variance (n_samples,); slope (n_samples, n_directions); fresh : just started, or
    at rest.
    """

    value: Array
    variance: Array
    slope: Array
    fresh: NDArray[np.bool_]


def prepared(model: ValveModel, data: Measurements) -> ModelFilter | None:
    """The filter of a model for the signals that are there; None when no force can be had from them.

    Raises BadInput for a model that a filter cannot follow.
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
    noise = max(_least(model.noise.get("position_m"), noise_of(x[np.isfinite(x)])), 1e-9)
    measured, dt_s = noise_of(force[np.isfinite(force)]), float(np.median(np.diff(data.time_s)))
    force_noise = max(_least(model.noise.get("force_N"), measured), 1e-3 * values["lugre.fc"])
    return ModelFilter(
        effects, values, None if area is None else float(area), noise, force_noise, 0.3 * noise, dt_s,
        _smoothing(x, dt_s, noise), _loads(data),
    )  # fmt: skip


def trimmed(filter: ModelFilter, data: Measurements) -> ModelFilter:
    """The filter with its levels brought to the plant."""
    part = data[:MOST_SAMPLES]
    for _ in range(ROUNDS):
        run = innovations(filter, part)
        used = ~run.fresh
        weight = 1.0 / run.variance[used]
        slope, value = run.slope[used], run.value[used]
        columns = [_FRICTION, _OFFSET, _STIFFNESS, *range(len(DIRECTIONS) + 1, slope.shape[1])]
        shows = slope[:, columns]
        scale = np.median(value**2 * weight) / 0.45 + 1e-12
        information = (shows.T * weight) @ shows / max(scale, 1.0) + np.diag(_prior(filter))
        change = np.linalg.solve(information, (shows.T * weight) @ value / max(scale, 1.0))
        filter = _changed(filter, np.asarray(change, np.float64))
    return filter


def learned_test(filter: ModelFilter, data: Measurements, per_month: float) -> tuple[ChangeTest, Array]:
    """Sizes, usual energy and limits on fault-free data; and the scores (n_samples, n_directions + 1) on them.

    filter : not trimmed yet. Each half of the data is judged by the filter trimmed on the other: on data that it was
    trimmed on a filter looks better than it is.
    """
    half = len(data) // 2
    first, second = data[:half], data[half:]
    run = _joined(innovations(trimmed(filter, second), first), innovations(trimmed(filter, first), second))
    used = ~run.fresh
    usual = float(np.mean(np.minimum(run.value**2 / run.variance, 100.0)[used])) + 1e-12
    level, noise = max(filter.values["lugre.fc"], 1e-3), filter.force_noise
    noisy = 2.0 * np.array([noise / level, 0.0, noise])  # a change that drowns in the noise of the force is none
    sizes = np.maximum.reduce([np.array(LEAST_SIZES) * (1.0, 1.0, level), noisy, 2.0 * _wander(run, used)])
    test = ChangeTest(tuple(sizes.tolist()), usual, (1e12,) * (N + 1))
    sums = replayed(test, run)
    dt_s, strokes = float(np.median(np.diff(data.time_s))), strokes_of(data.values["position"])
    least = least_limit(dt_s, per_month / (2 * N + 1))
    wanted = [Blocks.of(row, dt_s, strokes).limit(per_month / (N + 1)) for row in sums.T]
    limits = np.maximum(np.maximum(wanted, MARGIN * sums.max(axis=0)), least)
    return replace(test, limits=tuple(limits.tolist())), sums / limits


def innovations(filter: ModelFilter, data: Measurements) -> Innovations:
    """The filter over data, started anew at gaps and passing over what is missing."""
    found, fresh = list[Innovation](), np.zeros(len(data), bool)
    state, since = None, 0
    gap = 5.0 * float(np.median(np.diff(data.time_s)))
    width = len(DIRECTIONS) + 1 + 2 * len(filter.loads)
    nothing = Innovation(0.0, filter.position_noise**2, np.zeros(width))
    for i, row in enumerate(data):
        if not np.isfinite(row.values["position"] + filter.force(row)):
            found.append(nothing)
            fresh[i] = True
            continue
        if state is None or row.time_s - state.time_s > gap:
            state, since = filter.start(row), 0
            found.append(nothing)
        else:
            state, one = filter.step(state, row)
            found.append(one)
        since += 1
        fresh[i] = since <= SKIPPED or found[-1].resting
    return Innovations(
        np.array([one.value for one in found]), np.array([one.variance for one in found]),
        np.array([one.slope for one in found]), fresh,
    )  # fmt: skip


def _joined(first: Innovations, second: Innovations) -> Innovations:
    """One after the other."""
    names = ("value", "variance", "slope", "fresh")
    return Innovations(*(np.concatenate([getattr(first, name), getattr(second, name)]) for name in names))


def replayed(test: ChangeTest, run: Innovations) -> Array:
    """The sums of a test over a run, (n_samples, n_directions + 1); those of fresh samples are zero."""
    evidence, sums = test.start(), np.zeros((len(run.value), N + 1))
    limits = np.array(test.limits)
    for i in range(len(run.value)):
        if run.fresh[i]:
            continue
        seen = Innovation(float(run.value[i]), float(run.variance[i]), run.slope[i])
        evidence = test.step(evidence, seen)
        sums[i] = test.scores(evidence) * limits
    return sums


def _wander(run: Innovations, used: NDArray[np.bool_]) -> Array:
    """How far each direction seems to move without a fault: rms of its estimates over stretches of the data."""
    n, found = max(100, int(np.sum(used)) // 40), []
    value, weight, slope = run.value[used], 1.0 / run.variance[used], run.slope[used][:, :N]
    for first in range(0, len(value) - n + 1, n):
        part = slice(first, first + n)
        information = weight[part] @ slope[part] ** 2
        found.append((information, (weight * value)[part] @ slope[part]))
    if not found:
        return np.zeros(N)
    informations, scores = (np.array(row) for row in zip(*found, strict=True))
    heavy = informations > 0.1 * np.median(informations, axis=0)
    estimates = np.where(heavy, scores / np.maximum(informations, 1e-300), 0.0)
    return np.sqrt(np.mean(estimates**2, axis=0))


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
            if np.std(p) > 3.0 * noise_of(p):
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
