"""A watch from a known-good model alone: what it would have learned of the valve that the model describes.

Healthy data are simulated with the model, for every stretch with other parameters within their standard deviations and
other forces within the error of the model's free run, the noise of the sensors on top. So what the fit does not know
widens every limit. A model does not say how its valve will be moved: half of the stretches have sines, the others
steps, between whose samples the force bends as it does behind a positioner.

On one valve an error of the model lasts, and evidence that adds up would take it for a fault. So what lasts is told
from what comes and goes: the means of the stretches say how far a healthy valve may be from the model. The data stand
for the shortest learning time whose promise was measured and for no more, however much were simulated.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace
from math import ceil, exp

import numpy as np

from detector.alarms import Evidence, learn_evidence
from detector.measurements import Measurements
from detector.observer.calibration_fit import calibrate
from detector.watch.learning import wished
from detector.watch.model.filter import SUBSTEP
from detector.watch.model.generator import TESTS, learned_model
from detector.watch.watch import Watch
from recordings import Array, BadInput
from simulator import CATALOGUE, Catalogue, Value, ValveModel, kernel

STANDS_FOR_S = 80.0
"""The learning time that a model alone stands for [s]."""

SIMULATED_S, SAMPLES, STRETCHES = 450.0, (3000, 9000), 30
"""How much is simulated [s], in how many samples at least and at most, and in how many stretches, each with other
parameters.
"""

PERIODS_S = (14.0, 5.3)
"""The stem is moved to and fro by two sines [s], over the middle of its stroke."""

STEP_S, LAG_S = (1.5, 6.0), 0.15
"""Or by steps that last so long [s], which the pressure follows with a lag [s]."""

LOOSE = ("mass.m", "lugre.vs", "lugre.sigma0", "lugre.sigma1", "lugre.sigma2")
"""What data at plant rates often do not tell. They do not depend on it then, and the error of the free run, which has
its own distance from the truth in it, is all that is known of it.
"""

LASTING = 4.0
"""So many standard deviations a valve may be from its model."""

LEAST_FRICTION = 0.8
"""What the model does not know takes at most so much of the friction away."""

NO_FORCE = "neither a force is measured, nor a pressure whose diaphragm_area_m2 its plant has"

_SEED = 1


def learn_model(
    model: ValveModel, dt_s: float, signals: Container[str], per_month: float = 1.0, *, catalogue: Catalogue = CATALOGUE
) -> Watch:
    """The detector of a valve from its model alone, for samples dt_s [s] apart.

    signals : names of what is measured, with the force, or the pressure where the model has a diaphragm area. There is
    no relation of flow or set point, and no level of a pressure: a model does not have them. The observer runs without
    being judged.
    per_month : false alarms a month that are wished at most.
    Raises BadInput for a model that does not say how well it is known, or by which force and how far the valve moves.
    """
    stroke, area = (model.plant.get(name) for name in ("stroke_m", "diaphragm_area_m2"))
    if not isinstance(stroke, float | int):
        raise _refused("its plant has no stroke_m")
    name, per_newton = "force", 1.0
    if "force" not in signals:
        if "pressure" not in signals or not isinstance(area, float | int):
            raise _refused(NO_FORCE)
        name, per_newton = "pressure", 1.0 / float(area)
    _check(model)
    data = _simulated(model, dt_s, float(stroke), catalogue)
    values = {"position": data.values["position"], name: per_newton * data.values["force"]}
    data = Measurements(data.time_s, values)
    learned = learned_model(model, data, catalogue)
    if learned is None:
        raise _refused(NO_FORCE)
    evidence = _evidence(learned[1], dt_s, wished(per_month))
    # The observer is a line through how the valve is moved, and a model does not say how it will be.
    return Watch(calibrate(data), None, learned[0], None, (), evidence)


def _evidence(residuals: Array, dt_s: float, wish_s: float) -> Evidence:
    """What is healthy of residuals (n_samples, n_tests) of the stretches: around the mean of each, what each valve
    does; the means, by how much the model may be wrong on a valve, for as long as it is watched.
    """
    stretches = residuals.reshape(STRETCHES, -1, len(TESTS))
    counts = np.sum(np.isfinite(stretches), axis=1)
    seen = np.maximum(counts, 1)  # of a test that nothing is seen of nothing is learned
    means = np.nansum(stretches, axis=1) / seen
    middle = np.average(means, axis=0, weights=seen)
    spread = np.sqrt(np.average((means - middle) ** 2, axis=0, weights=seen))
    around = (stretches - means[:, None]).reshape(-1, len(TESTS))
    evidence = learn_evidence(dict(zip(TESTS, around.T, strict=True)), dt_s, wish_s)
    healthy = []
    for name, one in zip(evidence.names, evidence.healthy, strict=True):
        test = TESTS.index(name)
        bias = LASTING * float(spread[test]) / one.size
        healthy.append(replace(one, centre=one.centre + float(middle[test])).allowing(bias))
    promise = evidence.promise.after(min(STANDS_FOR_S, evidence.promise.seconds))
    note = "started from the model alone: its forces are judged; learn from the valve for all else"
    return replace(evidence, healthy=tuple(healthy), promise=promise, notes=(note,))


def _check(model: ValveModel) -> None:
    """Raise BadInput for a model that cannot say how far it may be from the valve."""
    if model.values.get("spring.K", 0.0) <= 0.0:
        raise _refused("it has no spring, so that no force leads to a position")
    for name, value in model.parameters.items():
        if value.status == "unresolved" and name not in LOOSE:
            raise _refused(f"its {name} is unresolved")
    if all(value.std is None for value in model.parameters.values()) or not _error(model):
        raise _refused("it has no standard deviations, or no error of a free run")


def _refused(found: str) -> BadInput:
    remedy = "fit it to better recordings, or learn from the valve's first seconds or from recordings of it"
    return BadInput("start from the model alone", found, remedy, parameter="learn_s")


def _error(model: ValveModel) -> float:
    """Root mean square of the free run's error [m], on data that were not fitted where there are some."""
    found = model.error.get("holdout") or model.error.get("fit") or {}
    return found.get("rmse_m", 0.0)


def _simulated(model: ValveModel, dt_s: float, stroke: float, catalogue: Catalogue) -> Measurements:
    """Position and force of healthy motion, in stretches with other parameters each, a gap between two."""
    random = np.random.default_rng(_SEED)
    n = min(max(round(SIMULATED_S / dt_s), SAMPLES[0]), SAMPLES[1]) // STRETCHES
    parts = []
    for k in range(STRETCHES):
        finely = max(ceil(dt_s / SUBSTEP), 1)
        t = dt_s / finely * np.arange(k * n * finely, (k + 1) * n * finely, dtype=np.float64)
        force = _force(model, _moved(t, steps=k % 2 == 1, random=random), stroke, t)
        position = _answer(model, t, force, random, catalogue)
        measured = (_noisy(model, "position_m", position, random), _noisy(model, "force_N", force, random))
        parts.append((t[::finely] + k * 1000.0 * dt_s, *(values[::finely] for values in measured)))
    time_s, position, force = (np.concatenate(rows) for rows in zip(*parts, strict=True))
    return Measurements(time_s, {"position": position, "force": force})


def _moved(t: Array, steps: bool, random: np.random.Generator) -> Array:
    """Where the stem is to be, as a share of its stroke."""
    if not steps:
        first, second = (np.sin(2.0 * np.pi * t / period) for period in PERIODS_S)
        return np.asarray(0.5 + 0.25 * first + 0.08 * second)
    most = ceil((t[-1] - t[0]) / STEP_S[0]) + 1
    begins = np.cumsum(random.uniform(*STEP_S, most))
    return random.uniform(0.15, 0.85, most + 1)[np.searchsorted(begins, t - t[0])]


def _force(model: ValveModel, share: Array, stroke: float, t: Array) -> Array:
    """The force that leads there [N], against the friction, behind the lag."""
    from scipy.signal import lfilter

    known = model.values
    way = np.sign(np.diff(share, prepend=share[0]))
    way = way[np.maximum.accumulate(np.where(way != 0.0, np.arange(len(way)), 0))]
    wanted = known["spring.F0"] + known["spring.K"] * stroke * share + known["lugre.fc"] * way
    keep = exp(-float(t[1] - t[0]) / LAG_S)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], wanted, zi=[keep * wanted[0]])[0])


def _drawn(model: ValveModel, random: np.random.Generator) -> dict[str, float]:
    """The parameters of a valve that the model may be; those that are unresolved stay.

    What the model misses of a free run are forces that it does not know, for a stem that rests keeps the position at
    which they left it: the spring's over that way, on the friction and along the stroke.
    """
    drawn = {name: _within(value, random) for name, value in model.parameters.items()}
    friction, push = drawn["spring.K"] * _error(model) * random.normal(size=2)
    friction = max(friction, -LEAST_FRICTION * drawn["lugre.fc"])
    known = {"lugre.fc": friction, "lugre.fs": friction, "spring.F0": push}
    return drawn | {name: drawn[name] + float(more) for name, more in known.items()}


def _within(known: Value, random: np.random.Generator) -> float:
    """What a parameter may be by its standard deviation."""
    value = known.value + (known.std or 0.0) * float(random.normal())
    return value if value * known.value > 0 else known.value


def _answer(model: ValveModel, t: Array, force: Array, random: np.random.Generator, catalogue: Catalogue) -> Array:
    """Position [m] of a valve that the model may be, under a force [N]."""
    valve, known = kernel(model.effects, catalogue=catalogue), model.values
    start = valve.start((float(force[0]) - known["spring.F0"]) / known["spring.K"], 0.0, float(force[0]))
    run = valve.run(t, force, valve.vector(_drawn(model, random)), start, h_max=SUBSTEP)
    if run.failed is not None:
        raise _refused("it cannot be simulated within its standard deviations")
    return run.outputs[:, 0]


def _noisy(model: ValveModel, name: str, values: Array, random: np.random.Generator) -> Array:
    """With the noise of a sensor."""
    return values + (model.noise.get(name) or 0.0) * random.normal(size=len(values))
