"""A watch from a known-good model alone: what it would have learned of the valve that the model describes.

Healthy data are simulated with the model, its parameters drawn anew from their standard deviations for every stretch,
its own free-run error and the noise of the sensors on top. So what the fit does not know widens every limit. They stand
for the shortest learning time whose promise was measured and for no more, however much were simulated.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace
from math import exp, sqrt

import numpy as np

from detector.measurements import Measurements
from detector.watch.learning import learn
from detector.watch.model.filter import SUBSTEP
from detector.watch.watch import OBSERVER, Watch
from recordings import Array, BadInput
from simulator import CATALOGUE, Catalogue, Value, ValveModel, kernel

STANDS_FOR_S = 80.0
"""The learning time that a model alone stands for [s]."""

LEAST_SAMPLES, STRETCHES = 800, 8
PERIODS_S = (14.0, 5.3)
"""The stem is moved to and fro by two sines [s], over the middle of its stroke."""

_ERROR_S = 2.0
"""The error of a model's free run stays for so long [s]."""

_SEED = 1


def learn_model(
    model: ValveModel, dt_s: float, signals: Container[str], per_month: float = 1.0, *, catalogue: Catalogue = CATALOGUE
) -> Watch:
    """The detector of a valve from its model alone, for samples dt_s [s] apart.

    signals : names of what is measured, with the force, or the pressure where the model has a diaphragm area. There is
    no relation of flow or set point, and no level of a pressure: a model does not have them. The observer runs without
    being judged.
    Raises BadInput for a model that does not say how well it is known, or by which force and how far the valve moves.
    """
    stroke, area = (model.plant.get(name) for name in ("stroke_m", "diaphragm_area_m2"))
    if not isinstance(stroke, float | int):
        raise _refused("its plant has no stroke_m")
    name, per_newton = "force", 1.0
    if "force" not in signals:
        if "pressure" not in signals or not isinstance(area, float | int):
            raise _refused("neither a force is measured, nor a pressure whose diaphragm_area_m2 its plant has")
        name, per_newton = "pressure", 1.0 / float(area)
    _check(model)
    data = _simulated(model, dt_s, float(stroke), catalogue)
    values = {"position": data.values["position"], name: per_newton * data.values["force"]}
    # The observer is a line through how the valve is moved, and a model does not say how it will be.
    watch = learn(Measurements(data.time_s, values), model, per_month, without=(OBSERVER,), catalogue=catalogue)
    evidence = watch.evidence
    parts = "observer, flow, set point and pressures"
    note = f"started from the model alone: {parts} are not judged; learn from the valve for them"
    promise = evidence.promise.after(min(STANDS_FOR_S, evidence.promise.seconds))
    return replace(watch, evidence=replace(evidence, promise=promise, notes=(*evidence.notes, note)))


def _check(model: ValveModel) -> None:
    """Raise BadInput for a model that cannot say how far it may be from the valve."""
    if model.values.get("spring.K", 0.0) <= 0.0:
        raise _refused("it has no spring, so that no force leads to a position")
    for name, value in model.parameters.items():
        if value.status == "unresolved":
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
    n = max(round(STANDS_FOR_S / dt_s), LEAST_SAMPLES) // STRETCHES
    parts = []
    for k in range(STRETCHES):
        t = dt_s * np.arange(k * n, (k + 1) * n, dtype=np.float64)
        position, force = _stretch(model, t, stroke, random, catalogue)
        parts.append((t + k * 1000.0 * dt_s, position, force))
    time_s, position, force = (np.concatenate(rows) for rows in zip(*parts, strict=True))
    return Measurements(time_s, {"position": position, "force": force})


def _drawn(known: Value, random: np.random.Generator) -> float:
    """What a parameter may be as well."""
    value = known.value + (known.std or 0.0) * float(random.normal())
    return value if value * known.value > 0 else known.value


def _stretch(
    model: ValveModel, t: Array, stroke: float, random: np.random.Generator, catalogue: Catalogue
) -> tuple[Array, Array]:
    """Measured position [m] and force [N] of one stretch."""
    from scipy.signal import lfilter

    first, second = (np.sin(2.0 * np.pi * t / period) for period in PERIODS_S)
    valve, known = kernel(model.effects, catalogue=catalogue), model.values
    force = known["spring.F0"] + known["spring.K"] * stroke * (0.5 + 0.25 * first + 0.08 * second)
    drawn = {name: _drawn(value, random) for name, value in model.parameters.items()}
    start = valve.start((float(force[0]) - known["spring.F0"]) / known["spring.K"], 0.0, float(force[0]))
    run = valve.run(t, force, valve.vector(drawn), start, h_max=SUBSTEP)
    if run.failed is not None:
        raise _refused("it cannot be simulated within its standard deviations")
    keep = exp(-float(t[1] - t[0]) / _ERROR_S)
    pushed = sqrt(1.0 - keep * keep) * _error(model) * random.normal(size=len(t))
    error = lfilter([1.0], [1.0, -keep], pushed)
    noise = [(model.noise.get(name) or 0.0) * random.normal(size=len(t)) for name in ("position_m", "force_N")]
    return run.outputs[:, 0] + error + noise[0], force + noise[1]
