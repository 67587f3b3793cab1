"""The monitor: samples and link events of a source in, events out. The same for a plant and for a recording.

It holds no socket, file or clock: time is the samples' own, so that a recording of a session gives the same decisions
bit for bit. What happens to the link is passed on as it is; it is never a fault of the valve.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Mapping, Sequence
from datetime import UTC, datetime
from typing import Self

from detector import MONTH_S, Measurements, Watch, WatchState, learn, learn_model
from hil.monitor.event import MonitorEvent
from hil.monitor.link_news import LinkNews
from hil.monitor.meanwhile import Meanwhile, Starter
from hil.monitor.units import SampleConverter
from hil.monitor.valve import Learner, ValveWatch, WatchStatus
from hil.source.sample import EventKind, LinkEvent, Sample, elapsed
from recordings import BadInput, SignalSpec
from simulator import CATALOGUE, Catalogue, ValveModel

OnLearned = Callable[[str, Watch], None]
"""Called with the name of a valve and its detector, once it is learned."""


class Monitor:
    """Watches the valves of a source.

    signals : what each valve's samples bring, by its name; learner : makes a detector from fault-free data; learn_s :
    how long each valve learns [s], None when nothing is to be learned; stroke_m : see `SampleConverter`; own_clock :
    whether the samples' time is used as it is (a recording), instead of from the first sample on; on_learned : see
    `OnLearned`; starter, wish_s : what judges while they learn, see `Meanwhile`. Raises BadInput for valves without a
    position.
    """

    def __init__(
        self,
        signals: Mapping[str, Sequence[SignalSpec]],
        learner: Learner,
        learn_s: float | None = None,
        *,
        stroke_m: float | None = None,
        own_clock: bool = False,
        on_learned: OnLearned | None = None,
        starter: Starter | None = None,
        wish_s: float = 0.0,
    ) -> None:
        self.valves = {name: ValveWatch(name, learner, learn_s, Meanwhile(starter, wish_s)) for name in signals}
        self.alarms = 0
        self._links = {name: LinkNews() for name in signals}
        self._converters = {name: SampleConverter(name, specs, stroke_m) for name, specs in signals.items()}
        self._own_clock, self._on_learned = own_clock, on_learned
        self._origin: float | None = None
        self._started = 0.0

    @classmethod
    def with_model(
        cls,
        signals: Mapping[str, Sequence[SignalSpec]],
        model: ValveModel,
        false_alarms: float = 1.0,
        learn_s: float | None = None,
        *,
        own_clock: bool = False,
        on_learned: OnLearned | None = None,
        catalogue: Catalogue = CATALOGUE,
    ) -> Self:
        """A monitor whose detectors use a model of the valve, and its stroke where the position comes as a share of it.

        false_alarms : allowed a month; catalogue : where the model's effects are looked up; the others as for the
        monitor itself.
        """

        def learner(data: Measurements) -> Watch:
            return learn(data, model, false_alarms, catalogue=catalogue)

        def starter(dt_s: float, names: Collection[str]) -> Watch:
            return learn_model(model, dt_s, names, false_alarms, catalogue=catalogue)

        stroke = model.plant.get("stroke_m")
        return cls(
            signals, learner, learn_s, stroke_m=stroke if isinstance(stroke, float) else None, own_clock=own_clock,
            on_learned=on_learned, starter=starter, wish_s=MONTH_S / false_alarms if false_alarms > 0 else 0.0,
        )  # fmt: skip

    def resume(self, known: Mapping[str, tuple[Watch, WatchState | None]]) -> tuple[str, ...]:
        """Go on with what is known of valves by name: a detector, and its state where it has one.

        Returns the names of the valves that are watched now; what is known of others is not used.
        """
        names = tuple(name for name in self.valves if name in known)
        for name in names:
            self.valves[name].resume(*known[name])
        return names

    def start(
        self, model: ValveModel, dt_s: float, false_alarms: float = 1.0, *, catalogue: Catalogue = CATALOGUE
    ) -> None:
        """Watch every valve of which nothing is known, from its model alone: `detector.learn_model`.

        dt_s : time from sample to sample [s]. Raises BadInput when the model is not known well enough for that.
        """
        for name, valve in self.valves.items():
            if valve.watch is None:
                valve.resume(learn_model(model, dt_s, self._converters[name].names, false_alarms, catalogue=catalogue))

    async def take(self, item: Sample | LinkEvent) -> MonitorEvent | None:
        """One item of the source, in order; the event that it makes, if any. Learning is done in a thread of its own.

        Raises BadInput when what was gathered cannot be learned from, or there is nothing to judge by.
        """
        news = self._links[item.valve]
        if isinstance(item, LinkEvent):
            return self._told(item, item.kind, item.text) if news.told(item) else None
        event = await self._judged(item)
        if event is not None:
            self.alarms += event.kind == "alarm"
            return event
        holds = news.holds(item.time)
        return None if holds is None else self._told(item, "link_up", holds)

    def _told(self, item: Sample | LinkEvent, kind: EventKind, text: str) -> MonitorEvent:
        moment = 0.0 if self._origin is None else item.time - self._origin
        wall = item.wall if self._origin is None else self._started + moment
        return MonitorEvent(moment, wall, item.valve, kind, text)

    async def _judged(self, item: Sample) -> MonitorEvent | None:
        if self._origin is None:
            self._begin(item)
        moment, valve = elapsed(item.time, self._origin or 0.0), self.valves[item.valve]
        measured = self._converters[item.valve].measurement(item, moment)
        if valve.watch is None:
            if valve.gather(measured):
                watch = await asyncio.to_thread(valve.learn)
                if self._on_learned:
                    self._on_learned(item.valve, watch)
            elif valve.can_begin:
                await asyncio.to_thread(valve.begin)
            return None
        return valve.check(measured, self._started + moment)

    @property
    def status(self) -> tuple[WatchStatus, ...]:
        """How each valve stands, for a terminal, a page or metrics."""
        return tuple(valve.status for valve in self.valves.values())

    def check(self) -> None:
        """Raise BadInput for a valve of which nothing is known and nothing will be learned, or whose detector was
        learned with signals that do not come.
        """
        for name, valve in self.valves.items():
            if valve.watch is not None:
                valve.watch.check(self._converters[name].names, f"valve {name}")
            elif valve.learn_s is None:
                remedy = "learn from its first seconds or from recordings of it, or resume from an earlier session"
                raise BadInput(f"valve {name}", "nothing was learned of it yet", remedy, parameter="learn_s")

    def _begin(self, first: Sample) -> None:
        """The clock, as the recorder has it: it begins with the first sample, at a whole microsecond."""
        start = datetime.fromtimestamp(first.wall, UTC).timestamp()
        self._origin = 0.0 if self._own_clock else first.time
        self._started = start - first.time if self._own_clock else start
