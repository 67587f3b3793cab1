"""The detector to use: all that watches one valve, as one step from state and measurement to state and judgement."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from html import escape
from typing import Any

from detector.alarms.rates import FalseAlarms
from detector.measurements import Measurement, Measurements
from detector.observer.calibration import Calibration
from detector.observer.screening import SampleVerdict
from detector.observer.state import Decision
from detector.watch.flow_relation import FlowRelation
from detector.watch.judgement import KINDS, Judgement
from detector.watch.model.generator import TESTS, ModelState, ModelWatch
from detector.watch.pressure_level import PressureLevel
from detector.watch.state import WatchState
from detector.watch.words import described
from recordings import BadInput
from simulator import CATALOGUE, Catalogue

HOLD_S = 30.0
"""An alarm stands until nothing was above its limit for so long [s]."""

OBSERVER, FLOW = "observer", "flow relation"


@dataclass(frozen=True)
class Watch:
    """The detector of one valve: observer, and where they can be had model, flow relation and pressure levels.

    `learn` makes one. Holds no socket, file, clock or state.
    """

    calibration: Calibration
    model: ModelWatch | None
    flow: FlowRelation | None
    levels: tuple[PressureLevel, ...]
    false_alarms: FalseAlarms

    def __repr__(self) -> str:
        parts = ["observer"] + ["model"] * (self.model is not None) + ["flow"] * (self.flow is not None)
        return f"<Watch of {', '.join(self.signals)}: {', '.join(parts)}; {self.false_alarms.sentence}>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(described(self))}</pre>"

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that a measurement has to bring."""
        names = {"position", self.calibration.input, *(level.signal for level in self.levels)}
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
        return WatchState(self.calibration.observer.initial(), None, (0.0,) * len(self.levels), (0.0, 0.0))

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
        observer, decision = self.calibration.step(state.observer, moment)
        if not decision.verdict.used:
            return replace(state, observer=observer), Judgement(
                moment.time_s, state.alarm, False, False, False, state.kind, OBSERVER, decision.xi2, decision.rho, 0.0,
                decision.verdict,
            )  # fmt: skip
        fresh = decision.verdict is not SampleVerdict.USED
        model = self.model.step(state.model, moment, fresh, state.alarm) if self.model else None
        levels = tuple(level.step(s, moment) for level, s in zip(self.levels, state.levels, strict=True))
        flow = self.flow.step(state.flow, moment) if self.flow else state.flow
        scores = self._scores(model, levels, flow)
        last = state.observer
        ratio = min(abs(decision.xi2) / max(decision.rho, 1e-300), abs(last.xi2) / max(last.rho, 1e-300))  # two running
        scores[OBSERVER] = max(ratio, 1.0 + 1e-9) if decision.alarm else min(ratio, 1.0)
        seen = replace(state, observer=observer, model=model, levels=levels, flow=flow)
        after = self._alarmed(seen, moment.time_s, scores)
        return after, self._judgement(state, after, scores, decision)

    def _scores(
        self, model: ModelState | None, levels: tuple[float, ...], flow: tuple[float, float]
    ) -> dict[str, float]:
        """Every score but the observer's, by name of its test."""
        scores: dict[str, float] = {}
        if self.model is not None and model is not None:
            scores |= zip(TESTS, self.model.scores(model).tolist(), strict=True)
        scores |= {level.signal: level.score(s) for level, s in zip(self.levels, levels, strict=True)}
        if self.flow is not None:
            scores[FLOW] = self.flow.score(flow)
        return scores

    def _alarmed(self, state: WatchState, now: float, scores: Mapping[str, float]) -> WatchState:
        over = max(scores.values()) > 1.0
        over_s = now if over else state.over_s
        alarm = over or (state.alarm and now - over_s < HOLD_S)
        kind = (self._kind(state.model, scores) or state.kind) if alarm else None
        return replace(state, alarm=alarm, over_s=over_s, kind=kind, last_s=now)

    def _kind(self, model: ModelState | None, scores: Mapping[str, float]) -> str | None:
        """The name for what is above its limit. Pressures speak first: what they do to the valve is no fault of it."""
        if scores.get("supply_pressure", 0.0) > 1.0:
            return "supply"
        if max(scores.get("upstream_pressure", 0.0), scores.get("downstream_pressure", 0.0)) > 1.0:
            return "flow"
        by_model = max((scores.get(name, 0.0) for name in TESTS), default=0.0) > 1.0
        if scores.get(FLOW, 0.0) > 1.0:
            return "sensor" if by_model else "flow"
        found = self.model.kind(model) if self.model and model and by_model else None
        return found if found in KINDS else None

    def _judgement(
        self, before: WatchState, after: WatchState, scores: Mapping[str, float], decision: Decision
    ) -> Judgement:
        test = max(scores, key=lambda name: scores[name])
        span = abs(self.calibration.position_span)
        pair = (abs(decision.xi2) * span, decision.rho * span) if test == OBSERVER else (scores[test], 1.0)
        began, ended = after.alarm and not before.alarm, before.alarm and not after.alarm
        renamed = after.alarm and before.alarm and after.kind != before.kind
        gap = after.last_s - before.last_s if decision.verdict is SampleVerdict.GAP else 0.0
        return Judgement(
            after.last_s,
            after.alarm,
            began,
            ended,
            renamed,
            after.kind,
            test,
            *pair,
            scores[test],
            decision.verdict,
            gap,
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON; `Watch.from_dict` gives the same back."""
        return {
            "calibration": self.calibration.as_dict(),
            "model": None if self.model is None else self.model.as_dict(),
            "flow": None if self.flow is None else self.flow.as_dict(),
            "levels": [[level.signal, level.middle, level.half] for level in self.levels],
            "false_alarms": self.false_alarms.as_dict(),
        }

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any], catalogue: Catalogue = CATALOGUE) -> Watch:
        """What `as_dict` gave, with effects of a `catalogue`. Raises BadInput for anything else."""
        try:
            return cls(
                Calibration.from_dict(parts["calibration"]),
                None if parts["model"] is None else ModelWatch.from_dict(parts["model"], catalogue),
                None if parts["flow"] is None else FlowRelation.from_dict(parts["flow"]),
                tuple(PressureLevel(*level) for level in parts["levels"]),
                FalseAlarms.from_dict(parts["false_alarms"]),
            )
        except BadInput:
            raise
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise BadInput("learned detector", f"it cannot be read ({error!r})", "learn anew") from None

    def state_from_dict(self, parts: Mapping[str, Any]) -> WatchState:
        """The state that `WatchState.as_dict` wrote for this watch. Raises BadInput for anything else."""
        state = WatchState.from_dict(parts)
        if len(state.levels) != len(self.levels) or (state.model is not None and self.model is None):
            raise BadInput("state of the detector", "it belongs to another detector", "learn anew")
        return state
