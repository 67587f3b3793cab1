"""The detector to use: all that watches one valve, as one step from state and measurement to state and judgement."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from html import escape
from math import nan
from typing import Any

import numpy as np

from detector.alarms import Evidence, EvidenceState, Promise
from detector.measurements import Measurement, Measurements
from detector.observer.calibration import Calibration
from detector.observer.screening import SampleVerdict
from detector.observer.state import Decision
from detector.watch.flow_relation import FlowRelation
from detector.watch.judgement import ALONG_STROKE, AT_THE_FLOW, KINDS, Judgement
from detector.watch.model.generator import BEYOND, TESTS, ModelState, ModelWatch
from detector.watch.positioner.loop import PositionerLoop
from detector.watch.pressure_level import PressureLevel
from detector.watch.state import WatchState
from detector.watch.words import described
from recordings import Array, BadInput
from simulator import CATALOGUE, Catalogue

HOLD_S = 30.0
"""An alarm stands until nothing was above its limit for so long [s]."""

OBSERVER, POSITIONER, FLOW = "observer", "positioner", "flow relation"


@dataclass(frozen=True)
class Watch:
    """The detector of one valve: observer, and where they can be had positioner, model, flow relation and levels.

    `learn` makes one. Holds no socket, file, clock or state.

    >>> import bristle as br
    >>> watch = br.learn(br.simulate("sine:60,mixed:60", rate=50, position_noise=5e-6, seed=3))
    >>> watch.signals, watch.model is None
    (('force', 'position'), True)
    """

    calibration: Calibration
    positioner: PositionerLoop | None
    model: ModelWatch | None
    flow: FlowRelation | None
    levels: tuple[PressureLevel, ...]
    evidence: Evidence

    def __repr__(self) -> str:
        named = {"positioner": self.positioner, "model": self.model, "flow": self.flow}
        parts = ["observer", *(name for name, part in named.items() if part is not None)]
        return f"<Watch of {', '.join(self.signals)}: {', '.join(parts)}; {self.false_alarms.sentence}>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(described(self))}</pre>"

    @property
    def false_alarms(self) -> Promise:
        """How often it alarms without a fault at most, by what it was learned from."""
        return self.evidence.promise

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that a measurement has to bring."""
        names = {"position", self.calibration.input, *(level.signal for level in self.levels)}
        if self.positioner is not None:
            names |= set(self.positioner.signals)
        if self.model is not None:
            names |= {"force" if self.model.filter.area is None else "pressure"}
            names |= {load.signal for load in self.model.filter.loads}
        if self.flow is not None:
            names |= {self.flow.flow} | ({"upstream_pressure", "downstream_pressure"} if self.flow.drop else set())
        return tuple(sorted(names))

    def check(self, names: Container[str], where: str) -> None:
        """Raise BadInput, naming `where`, when one of the signals that were learned with is not among the names."""
        missing = [name for name in self.signals if name not in names]
        if missing:
            found = f"its detector was learned with {' and '.join(missing)}, and no {missing[0]} comes"
            raise BadInput(where, found, "learn from these signals, or give a source that has them all")

    def initial(self) -> WatchState:
        """The state before the first sample."""
        positioner = None if self.positioner is None else self.positioner.initial()
        levels = (0.0,) * len(self.levels)
        return WatchState(self.calibration.observer.initial(), positioner, None, self.evidence.initial(), levels)

    def resumed(self, state: WatchState) -> WatchState:
        """A state of an earlier session, to go on with: the clock of that session means nothing any more."""
        observer = self.calibration.observer
        screening = observer.initial().screening
        return replace(state, observer=replace(state.observer, screening=screening), over_s=-HOLD_S, last_s=0.0)

    def run(self, state: WatchState, data: Measurements) -> tuple[WatchState, list[Judgement]]:
        """Many measurements in a row: `step` on one after the other."""
        found = []
        for moment in data:
            state, judgement = self.step(state, moment)
            found.append(judgement)
        return state, found

    def step(self, state: WatchState, moment: Measurement) -> tuple[WatchState, Judgement]:
        """One measurement."""
        beyond = self._beyond(moment)
        observer, decision = self.calibration.step(state.observer, moment, state.alarm or beyond)
        if not decision.verdict.used:
            return replace(state, observer=observer), Judgement(
                moment.time_s, state.alarm, False, False, False, state.kind, OBSERVER, 0.0, 1.0, 0.0,
                decision.verdict,
            )  # fmt: skip
        fresh = decision.verdict is not SampleVerdict.USED
        residuals = {OBSERVER: self._observed(beyond, self.calibration.residual(observer, decision))}
        positioner, model = state.positioner, state.model
        if self.positioner is not None and positioner is not None:
            positioner, residuals[POSITIONER] = self.positioner.step(positioner, moment, state.alarm)
        if self.model is not None:
            wrong = nan if self.flow is None else self.flow.position_error(moment)
            model, said = self.model.step(state.model, moment, fresh, state.alarm, wrong)
            residuals |= zip(TESTS, said.tolist(), strict=True)
        if self.flow is not None:
            residuals[FLOW] = self.flow.departure(moment)
        row = np.array([[residuals[name] for name in self.evidence.names]])
        evidence, load = self.evidence.run(state.evidence, row)
        levels = tuple(level.step(s, moment) for level, s in zip(self.levels, state.levels, strict=True))
        scores = self._scores(evidence, load[0], levels)
        seen = WatchState(
            observer, positioner, model, evidence, levels, *self._alarmed(state, model, moment.time_s, scores)
        )
        return seen, self._judgement(state, seen, scores, decision)

    def _beyond(self, moment: Measurement) -> bool:
        """Whether the stem is beyond the learned positions, on a stop above all, where the balance is another one."""
        away = abs(moment.values["position"] - self.calibration.position_zero) / abs(self.calibration.position_span)
        return away > 0.5 + BEYOND

    def _observed(self, beyond: bool, residual: float) -> float:
        """The observer's residual; beyond the learned positions only a gross one counts."""
        if not beyond or OBSERVER not in self.evidence.names:
            return residual
        return residual if self.evidence.healthy[self.evidence.names.index(OBSERVER)].is_gross(residual) else nan

    def _scores(self, evidence: EvidenceState, load: Array, levels: tuple[float, ...]) -> dict[str, float]:
        """Every score by name of its test: an alarm at 1."""
        scores = dict(zip(self.evidence.names, self.evidence.scores(evidence, load).tolist(), strict=True))
        return scores | {level.signal: level.score(s) for level, s in zip(self.levels, levels, strict=True)}

    def _alarmed(
        self, before: WatchState, model: ModelState | None, now: float, scores: Mapping[str, float]
    ) -> tuple[bool, float, str | None, float, tuple[str, ...]]:
        """The last five of a state: alarm, over_s, kind, last_s, remaining."""
        over = max(scores.values()) >= 1.0
        over_s = now if over else before.over_s
        if not (over or (before.alarm and now - over_s < HOLD_S)):
            return False, over_s, None, now, ()
        found = self._kinds(before, model, scores)
        kinds = found or (before.kind,) if before.kind else found or before.remaining
        return (True, over_s, kinds[0], now, ()) if len(kinds) == 1 else (True, over_s, None, now, kinds)

    def _kinds(self, before: WatchState, model: ModelState | None, scores: Mapping[str, float]) -> tuple[str, ...]:
        """What remains of all kinds for what is above its limit: one is its name, none says nothing.

        Pressures speak first: what they do to the valve is no fault of it.
        """
        if scores.get("supply_pressure", 0.0) > 1.0:
            return ("supply",)
        if max(scores.get("upstream_pressure", 0.0), scores.get("downstream_pressure", 0.0)) > 1.0:
            return ("flow",)
        by_model = max((scores.get(name, 0.0) for name in TESTS), default=0.0) >= 1.0
        if scores.get(FLOW, 0.0) >= 1.0:
            both = by_model or before.kind == "sensor" or before.remaining == AT_THE_FLOW
            return self._at_the_flow(model) if both else ("flow",)
        found = self.model.kind(model) if self.model and model and by_model else None
        if found == "spring" and self.model and model:
            weak = self.model.spring_is_weak(model)
            return ("spring",) if weak or (weak is None and before.kind == "spring") else ALONG_STROKE
        return (found,) if found in KINDS else ()

    def _at_the_flow(self, model: ModelState | None) -> tuple[str, ...]:
        """What remains where flow and forces are not usual: the position sensor, the flow, or either."""
        wrong = self.model.position_is_wrong(model) if self.model and model else None
        return AT_THE_FLOW if wrong is None else ("sensor",) if wrong else ("flow",)

    def _judgement(
        self, before: WatchState, after: WatchState, scores: Mapping[str, float], decision: Decision
    ) -> Judgement:
        test = max(scores, key=lambda name: scores[name])
        began, ended = after.alarm and not before.alarm, before.alarm and not after.alarm
        same = (after.kind, after.remaining) == (before.kind, before.remaining)
        renamed = after.alarm and before.alarm and not same
        gap = after.last_s - before.last_s if decision.verdict is SampleVerdict.GAP else 0.0
        return Judgement(
            after.last_s, after.alarm, began, ended, renamed, after.kind, test, scores[test], 1.0, scores[test],
            decision.verdict, gap, after.remaining,
        )  # fmt: skip

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON; `Watch.from_dict` gives the same back."""
        return {
            "calibration": self.calibration.as_dict(),
            "positioner": None if self.positioner is None else self.positioner.as_dict(),
            "model": None if self.model is None else self.model.as_dict(),
            "flow": None if self.flow is None else self.flow.as_dict(),
            "levels": [[level.signal, level.middle, level.half] for level in self.levels],
            "evidence": self.evidence.as_dict(),
        }

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any], catalogue: Catalogue = CATALOGUE) -> Watch:
        """What `as_dict` gave, with effects of a `catalogue`. Raises BadInput for anything else."""
        try:
            return cls(
                Calibration.from_dict(parts["calibration"]),
                None if parts["positioner"] is None else PositionerLoop.from_dict(parts["positioner"]),
                None if parts["model"] is None else ModelWatch.from_dict(parts["model"], catalogue),
                None if parts["flow"] is None else FlowRelation.from_dict(parts["flow"]),
                tuple(PressureLevel(*level) for level in parts["levels"]),
                Evidence.from_dict(parts["evidence"]),
            )
        except BadInput:
            raise
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise BadInput("learned detector", f"it cannot be read ({error!r})", "learn anew") from None

    def state_from_dict(self, parts: Mapping[str, Any]) -> WatchState:
        """The state that `WatchState.as_dict` wrote for this watch. Raises BadInput for anything else."""
        state = WatchState.from_dict(parts)
        known, own = (0 if one is None else len(one) for one in (state.positioner, self.initial().positioner))
        wrong = (
            known != own
            or len(state.levels) != len(self.levels)
            or len(state.evidence.limits) != len(self.evidence.names)
        )
        if wrong or (state.model is not None and self.model is None):
            raise BadInput("state of the detector", "it belongs to another detector", "learn anew")
        return state
