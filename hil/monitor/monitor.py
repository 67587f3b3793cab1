"""The monitor: samples and link events of a source in, events out. The same for a plant and for a recording.

It holds no socket, file or clock: time is the samples' own, so that a recording of a session gives the same decisions
bit for bit. What happens to the link is passed on as it is; it is never a fault of the valve.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime

from detector import Watch
from hil.monitor.event import MonitorEvent
from hil.monitor.units import RowMaker
from hil.monitor.valve import Learner, ValveStatus, ValveWatch
from hil.source.sample import LinkEvent, Sample
from recordings import BadInput, SignalSpec

Tell = Callable[[str, Watch], None]
"""Told the valve and what was learned of it, once it is."""


class Monitor:
    """Watches the valves of a source.

    signals : what each valve's samples bring, by its name; learner : makes a detector from fault-free data; learn_s :
    how long each valve learns [s], None when nothing is to be learned; stroke_m : see `RowMaker`; own_clock : whether
    the samples' time is used as it is (a recording), instead of from the first sample on; told : see `Tell`.
    Raises BadInput for valves without a position.
    """

    def __init__(
        self,
        signals: Mapping[str, Sequence[SignalSpec]],
        learner: Learner,
        learn_s: float | None = None,
        *,
        stroke_m: float | None = None,
        own_clock: bool = False,
        told: Tell | None = None,
    ) -> None:
        self.valves = {name: ValveWatch(name, learner, learn_s) for name in signals}
        self.alarms = 0
        self._makers = {name: RowMaker(name, specs, stroke_m) for name, specs in signals.items()}
        self._own_clock, self._told = own_clock, told
        self._origin: float | None = None
        self._begun = 0.0

    async def take(self, item: Sample | LinkEvent) -> MonitorEvent | None:
        """One item of the source, in order; the event that it makes, if any. Learning is done in a thread of its own.

        Raises BadInput when what was gathered cannot be learned from, or there is nothing to judge by.
        """
        if isinstance(item, LinkEvent):
            moment = 0.0 if self._origin is None else item.time - self._origin
            wall = item.wall if self._origin is None else self._begun + moment
            return MonitorEvent(moment, wall, item.valve, item.kind, item.text)
        if self._origin is None:
            self._begin(item)
        moment, valve = item.time - (self._origin or 0.0), self.valves[item.valve]
        row = self._makers[item.valve].row(item, moment)
        if valve.watch is None:
            if valve.gather(row):
                watch = await asyncio.to_thread(valve.learn)
                if self._told:
                    self._told(item.valve, watch)
            return None
        event = valve.judge(row, self._begun + moment)
        self.alarms += event is not None and event.kind == "alarm"
        return event

    @property
    def status(self) -> tuple[ValveStatus, ...]:
        """How each valve stands, for a terminal, a page or metrics."""
        return tuple(valve.status for valve in self.valves.values())

    def check(self) -> None:
        """Raise BadInput for a valve of which nothing is known and nothing will be learned, or whose detector was
        learned with signals that do not come.
        """
        for name, valve in self.valves.items():
            missing = [] if valve.watch is None else self._makers[name].lacks(valve.watch.signals)
            if missing:
                found = f"its detector was learned with {' and '.join(missing)}, and no {missing[0]} comes"
                raise BadInput(f"valve {name}", found, "learn from these signals, or give a source that has them all")
            if valve.watch is None and valve.learn_s is None:
                remedy = "give --learn SECONDS, --calibrate REC, or the --state of an earlier session"
                raise BadInput(f"valve {valve.valve}", "nothing was learned of it yet", remedy)

    def _begin(self, first: Sample) -> None:
        """The clock, as the recorder has it: it begins with the first sample, at a whole microsecond."""
        begun = datetime.fromtimestamp(first.wall, UTC).timestamp()
        self._origin = 0.0 if self._own_clock else first.time
        self._begun = begun - first.time if self._own_clock else begun
