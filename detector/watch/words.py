"""What a detector has learned, in words: a line each."""

from __future__ import annotations

from typing import Protocol

from detector.alarms.rates import FalseAlarms
from detector.observer.calibration import Calibration
from detector.watch.flow_relation import FlowRelation
from detector.watch.model.generator import ModelWatch


class LearnedWatch(Protocol):
    """What is put into words of a detector: see `Watch`."""

    @property
    def calibration(self) -> Calibration: ...
    @property
    def model(self) -> ModelWatch | None: ...
    @property
    def flow(self) -> FlowRelation | None: ...
    @property
    def false_alarms(self) -> FalseAlarms: ...


def described(watch: LearnedWatch) -> str:
    """What was learned, in words: a line each."""
    c = watch.calibration
    rho = c.b1 / c.observer.k2 * c.position_span
    lines = [f"observer: input {c.input}, sampling time {c.dt_s:.4g} s, threshold {rho:.3g} m/s"]
    if watch.model is None:
        lines.append("model: not used, because no force (or pressure with a diaphragm area in the model) is measured")
    else:
        values = watch.model.filter.values
        friction, spring = (100 * size for size in watch.model.test.sizes[:2])
        lines.append(
            f"model: tuned to friction {values['lugre.fc']:.4g} N, spring {values['spring.K']:.5g} N/m; it is tested "
            f"for changes of {friction:.0f} % of the friction and {spring:.0f} % of the spring"
        )
    lines.append(f"flow: {'not used' if watch.flow is None else f'{watch.flow.flow} against the opening'}")
    lines.append(watch.false_alarms.sentence)
    return "\n".join(lines)
