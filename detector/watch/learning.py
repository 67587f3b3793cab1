"""Learning the detector of a valve from fault-free data, with the false-alarm rate of everything together."""

from __future__ import annotations

from collections.abc import Container

from detector.alarms import MONTH_S, learn_evidence
from detector.measurements import Measurements
from detector.observer.calibration_fit import calibrate, healthy_residual
from detector.watch.flow_relation import learned_flow
from detector.watch.model.generator import TESTS, learned_model
from detector.watch.positioner.fitting import learned_positioner
from detector.watch.pressure_level import learned_level
from detector.watch.strokes import check_strokes
from detector.watch.watch import FLOW, OBSERVER, POSITIONER, Watch
from recordings import BadInput, Progress, silent
from simulator import CATALOGUE, Catalogue, ValveModel

LEVELS = ("supply_pressure", "upstream_pressure", "downstream_pressure")

SHARES = {OBSERVER: 0.2, POSITIONER: 0.2, FLOW: 0.2} | dict.fromkeys(TESTS, 0.4 / len(TESTS))
"""How the allowed rate of false alarms is divided."""


def learn(
    data: Measurements,
    model: ValveModel | None = None,
    per_month: float = 1.0,
    *,
    without: Container[str] = (),
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Watch:
    """The detector for a valve from fault-free data in which it moves.

    model : of `bristle fit` or `trace`, used where force or pressure are measured; per_month : false alarms a month
    that are wished at most; without : names of residuals that are not judged; catalogue : where the model's effects are
    looked up. What so many data support of the wish is in the result, which goes on learning towards it.
    Raises BadInput when the data support nothing: too few, no motion, or nothing that drives the valve; and for an
    effect that the catalogue does not have.
    """
    wish_s = wished(per_month)
    progress("observer", 0, 0)
    calibration = calibrate(data)
    check_strokes(data.values["position"])
    residuals = {OBSERVER: healthy_residual(data, calibration)}
    progress("positioner", 0, 0)
    by_positioner = learned_positioner(data)
    if by_positioner is not None:
        residuals[POSITIONER] = by_positioner[1]
    progress("model", 0, 0)
    by_model = learned_model(model, data, catalogue) if model is not None else None
    if by_model is not None:
        residuals |= dict(zip(TESTS, by_model[1].T, strict=True))
    progress("flow and pressures", 0, 0)
    by_flow = learned_flow(data)
    if by_flow is not None:
        residuals[FLOW] = by_flow[1]
    judged = {name: values for name, values in residuals.items() if name not in without}
    evidence = learn_evidence(judged, calibration.dt_s, wish_s, SHARES)
    return Watch(
        calibration,
        None if by_positioner is None else by_positioner[0],
        None if by_model is None else by_model[0],
        None if by_flow is None else by_flow[0],
        tuple(level for name in LEVELS if (level := learned_level(data, name)) is not None),
        evidence,
    )


def wished(per_month: float) -> float:
    """Time between false alarms [s] where so many a month are wished. Raises BadInput for what is no rate."""
    if not per_month > 0:
        raise BadInput("false alarms", f"{per_month:g} a month is no rate", "give a positive number, for example 1")
    return MONTH_S / per_month
