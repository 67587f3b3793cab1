"""What a detector has learned, in words: a line each."""

from __future__ import annotations

from typing import Protocol

from detector.alarms import Evidence
from detector.observer.calibration import Calibration
from detector.watch.flow_relation import FlowRelation
from detector.watch.model.generator import ModelWatch
from detector.watch.positioner.loop import PositionerLoop


class LearnedWatch(Protocol):
    """What is put into words of a detector: see `Watch`."""

    @property
    def calibration(self) -> Calibration: ...
    @property
    def positioner(self) -> PositionerLoop | None: ...
    @property
    def model(self) -> ModelWatch | None: ...
    @property
    def flow(self) -> FlowRelation | None: ...
    @property
    def evidence(self) -> Evidence: ...


def described(watch: LearnedWatch) -> str:
    """What was learned, in words: a line each."""
    c = watch.calibration
    lines = [f"observer: input {c.input}, sampling time {c.dt_s:.4g} s"]
    if watch.positioner is None:
        lines.append("positioner: not used, because no set point leads the position")
    else:
        share = 100.0 * watch.positioner.deviation
        lines.append(f"positioner: the set point leads the position to {share:.2g} % of the learned stroke")
    if watch.model is None:
        lines.append("model: not used, because no force (or pressure with a diaphragm area in the model) is measured")
    else:
        values = watch.model.filter.values
        lines.append(f"model: tuned to friction {values['lugre.fc']:.4g} N, spring {values['spring.K']:.5g} N/m")
    lines.append(f"flow: {'not used' if watch.flow is None else f'{watch.flow.flow} against the opening'}")
    lines += watch.evidence.notes
    lines.append(watch.evidence.promise.sentence)
    return "\n".join(lines)
