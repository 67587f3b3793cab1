"""Learning the detector of a valve from fault-free data, with the false-alarm rate of everything together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from detector.alarms.rates import Blocks, strokes_of
from detector.measurements import Measurements
from detector.observer.calibration import SETTLE_SAMPLES
from detector.observer.calibration_fit import calibrate
from detector.watch.flow_relation import learned_flow
from detector.watch.model.generator import learned_model
from detector.watch.model.innovations import SKIPPED
from detector.watch.pressure_level import learned_level
from detector.watch.watch import Watch
from recordings import BadInput, Progress, silent
from simulator import CATALOGUE, Catalogue, ValveModel

LEVELS = ("supply_pressure", "upstream_pressure", "downstream_pressure")

SHARES = {"observer": 0.3, "model": 0.5, "flow": 0.2}
"""How the allowed rate of false alarms is divided."""


MOST_RAISED = 4.0
"""Limits that have to be raised further than this to keep to the rate mean that the data do not support it."""


def learn(
    data: Measurements,
    model: ValveModel | None = None,
    per_month: float = 1.0,
    *,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Watch:
    """The detector for a valve from fault-free data in which it moves.

    model : of `bristle fit` or `trace`, used where force or pressure are measured; per_month : false alarms a month
    that the upper end of the 95 % interval may reach; catalogue : where the model's effects are looked up.
    The rate of the result is measured on the same data.
    Raises BadInput when the data cannot support a rate: too few, no motion, or nothing that drives the valve; and for
    an effect that the catalogue does not have.
    """
    if not per_month > 0:
        raise BadInput("false alarms", f"{per_month:g} a month is no rate", "give a positive number, for example 1")
    progress("observer", 0, 0)
    calibration = calibrate(data, SHARES["observer"] * per_month)
    progress("model", 0, 0)
    by_model = learned_model(model, data, SHARES["model"] * per_month, catalogue) if model is not None else None
    progress("flow and pressures", 0, 0)
    by_flow = learned_flow(data, SHARES["flow"] * per_month)
    levels = tuple(level for name in LEVELS if (level := learned_level(data, name)) is not None)
    rows = [calibration.scores(data)]
    if by_model is not None:
        rows.append(by_model[1].max(axis=1))
    if by_flow is not None:
        rows.append(by_flow[1])
    blocks = Blocks.of(
        np.max(rows, axis=0)[max(SKIPPED, SETTLE_SAMPLES) :], calibration.dt_s, strokes_of(data.values["position"])
    )
    raised = max(blocks.limit(per_month), 1.0)
    if raised > MOST_RAISED:
        found = f"{blocks.seconds:.0f} s of data do not support {per_month:g} false alarms a month"
        remedy = f"learn from more data; these support {blocks.rate(MOST_RAISED).upper:.2g} a month"
        raise BadInput("false-alarm rate", found, remedy)
    return Watch(
        replace(calibration, b1=calibration.b1 * raised),
        None if by_model is None else by_model[0].raised(raised),
        None if by_flow is None else replace(by_flow[0], limit=by_flow[0].limit * raised),
        levels,
        blocks.rate(raised),
    )
