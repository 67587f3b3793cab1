"""One valve under watch: first its detector is learned, then every measurement is checked; changes make events."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from detector import (
    LEAST_STROKES,
    Judgement,
    Measurement,
    Measurements,
    SampleVerdict,
    Watch,
    WatchState,
    strokes_of,
)
from hil.monitor.event import MonitorEvent
from hil.monitor.meanwhile import Meanwhile
from hil.source.episode import Episode
from recordings import BadInput

Learner = Callable[[Measurements], Watch]
WatchPhase = Literal["learning", "watching", "alarm"]

MOST_GATHERED = 1_000_000
"""Samples that are kept for learning: a valve that does not move over so many cannot be learned."""

_COUNTED_EVERY = 0.05
"""Strokes are counted anew when the gathered time has grown by this share: all of it has to be looked through."""


@dataclass(frozen=True)
class WatchStatus:
    """A valve at a moment, for whoever looks. load : largest score, an alarm at 1; learned : share of the learning
    time that is over; samples : taken so far; strokes : seen of the `LEAST_STROKES` that learning needs; gathered_s :
    learned from so far [s]; judged, supported : in words, what is judged already while it learns, and how often a false
    alarm would come after what was gathered, both empty once it has learned.
    """

    valve: str
    phase: WatchPhase
    load: float
    fault: str | None
    learned: float
    samples: int
    strokes: int = 0
    gathered_s: float = 0.0
    judged: str = ""
    supported: str = ""

    @property
    def so_far(self) -> str:
        """How far learning is."""
        return f"{self.strokes} of {LEAST_STROKES} reversals, {self.gathered_s:.0f} s"


class ValveWatch:
    """What the monitor holds of one valve. watch, state : None until it is learned; learn_s : learning time [s], which
    goes on until the valve has moved to and fro `LEAST_STROKES` times; meanwhile : what is judged until then; measured,
    judgement : of the last sample, the latter None while nothing is judged.
    """

    def __init__(
        self, valve: str, learner: Learner, learn_s: float | None, meanwhile: Meanwhile | None = None
    ) -> None:  # fmt: skip
        self.valve, self._learner, self.learn_s = valve, learner, learn_s
        self._meanwhile = meanwhile or Meanwhile()
        self.watch: Watch | None = None
        self.state: WatchState | None = None
        self.measured: Measurement | None = None
        self.judgement: Judgement | None = None
        self._gathered = _Gathered()
        self._load, self._samples = 0.0, 0
        self._gaps: Episode | None = None
        self._strokes, self._count_s = 0, 0.0

    def resume(self, watch: Watch, state: WatchState | None = None) -> None:
        """Go on with what was learned before."""
        self.watch = watch
        self.state = watch.initial() if state is None else watch.resumed(state)

    def gather(self, moment: Measurement) -> bool:
        """Store a measurement for learning; returns whether time and strokes are enough now."""
        self._samples += 1
        self.measured = moment
        self._gathered.append(moment)
        self._meanwhile.check(moment)
        gathered_s = self._gathered_s
        if self.learn_s is None:
            return False
        if gathered_s >= self._count_s:
            self._strokes = strokes_of(self._gathered.measurements.values["position"])
            self._count_s = (1.0 + _COUNTED_EVERY) * gathered_s
        enough = self._strokes >= LEAST_STROKES or len(self._gathered) >= MOST_GATHERED
        return enough and gathered_s >= self.learn_s

    @property
    def _gathered_s(self) -> float:
        """Time that was gathered so far [s]."""
        return self._gathered.span_s

    @property
    def can_begin(self) -> bool:
        """Whether enough is known to judge something already: then `begin`."""
        return self.learn_s is not None and self._meanwhile.due(len(self._gathered))

    def begin(self) -> None:
        """Judge what can be judged before anything is learned."""
        self._meanwhile.begin(self._gathered.measurements)

    def learn(self) -> Watch:
        """Learn from what was gathered. Raises BadInput naming the valve when that cannot support a detector."""
        gathered, self._gathered = self._gathered.measurements, _Gathered()
        self._count_s = 0.0
        try:
            watch = self._learner(gathered)
        except BadInput as problem:
            raise BadInput(f"valve {self.valve}: {problem.where}", problem.found, problem.remedy) from None
        if self._meanwhile.doubt:
            notes = (*watch.evidence.notes, self._meanwhile.doubt)
            watch = replace(watch, evidence=replace(watch.evidence, notes=notes))
        self._meanwhile = Meanwhile()
        self.resume(watch)
        return watch

    def check(self, moment: Measurement, wall: float) -> MonitorEvent | None:
        """Check a measurement of a learned valve; the event that it makes, if any."""
        if self.watch is None or self.state is None:
            raise RuntimeError(f"{self.valve} is checked before it is learned")
        self._samples += 1
        self.measured = moment
        self.state, judgement = self.watch.step(self.state, moment)
        self.judgement = judgement
        self._load = judgement.load if judgement.verdict.used else self._load
        text = self._gap(judgement)
        if judgement.changed:
            return self._change(judgement, wall)
        return None if text is None else MonitorEvent(moment.time_s, wall, self.valve, "gap", text)

    def _gap(self, judgement: Judgement) -> str | None:
        """What to tell of gaps: when they begin, and when there was none for a while."""
        past, now = self._gaps, judgement.time_s
        if judgement.verdict is SampleVerdict.GAP and judgement.gap_s:
            if past is not None:
                past.again(now)
                return None
            self._gaps = Episode.begin(now)
            return f"no usable sample for {judgement.gap_s:.3g} s; the detector starts its errors anew"
        if past is None or not past.over(now):
            return None
        self._gaps = None
        return f"samples come without gaps again; there were {past.n} in {past.lasted_s:.1f} s" if past.more else None

    def _change(self, judgement: Judgement, wall: float) -> MonitorEvent:
        """The event of an alarm that began, ended, or got another kind."""
        numbers = (judgement.residual, judgement.threshold)
        if judgement.ended:
            text = "nothing above its limit any more"
            return MonitorEvent(judgement.time_s, wall, self.valve, "cleared", text, None, *numbers)
        return MonitorEvent(judgement.time_s, wall, self.valve, "alarm", _text(judgement), judgement.kind, *numbers)

    @property
    def status(self) -> WatchStatus:
        """How it stands."""
        if self.state is None:
            gathered_s = self._gathered_s
            learned = min(gathered_s / (self.learn_s or 1.0), 1.0)
            said = (self._meanwhile.judged, self._meanwhile.supported(gathered_s))
            return WatchStatus(
                self.valve, "learning", 0.0, None, learned, self._samples, self._strokes, gathered_s, *said
            )  # fmt: skip
        phase: WatchPhase = "alarm" if self.state.alarm else "watching"
        return WatchStatus(self.valve, phase, self._load, self.state.kind, 1.0, self._samples)


class _Gathered:
    """Measurements to learn from, as columns: a valve that waits a day for its strokes must not fill the memory."""

    def __init__(self) -> None:
        self._time = array("d")
        self._columns: dict[str, array[float]] = {}

    def __len__(self) -> int:
        return len(self._time)

    def append(self, moment: Measurement) -> None:
        if not self._columns:
            self._columns = {name: array("d") for name in moment.values}
        self._time.append(moment.time_s)
        for name, column in self._columns.items():
            column.append(moment.values[name])

    @property
    def span_s(self) -> float:
        return self._time[-1] - self._time[0] if self._time else 0.0

    @property
    def measurements(self) -> Measurements:
        columns = {name: np.array(column) for name, column in self._columns.items()}
        return Measurements(np.array(self._time), columns)


_WORDS = {
    "friction": "the friction has changed",
    "spring": "the spring, or the area of the diaphragm, has changed",
    "sensor": "position and flow do not fit each other: position sensor", "supply": "the supply pressure is not usual",
    "flow": "the flow, or the process pressures, are not what belongs to the opening", None: "unknown kind",
}  # fmt: skip


def _text(judgement: Judgement) -> str:
    kind = _WORDS[judgement.kind]
    if judgement.remaining:
        kind += f": {', '.join(judgement.remaining[:-1])} or {judgement.remaining[-1]}"
    again = "now named: " if judgement.renamed else ""
    numbers = f"test '{judgement.test}' at {judgement.residual:.3g}, limit {judgement.threshold:.3g}"
    return f"{again}{kind}; {numbers}"
