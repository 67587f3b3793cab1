"""Detection for one valve: its items in, what is seen of it out, as values that others read at any time."""

from __future__ import annotations

import asyncio
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from types import MappingProxyType

from detector import Watch, learn_recordings
from hil.monitor.event import MonitorEvent
from hil.monitor.monitor import Monitor
from hil.monitor.valve import ValveWatch
from hil.recorder.notes import Note, Notes
from hil.service.acquisition import ItemQueue, ValveLink
from hil.service.health import Standing, ValveFacts
from hil.service.in_service.figures import InServiceFigures
from hil.service.in_service.movements import Movements
from hil.service.plan import ValvePlan
from hil.service.recent import NewestEvents, RecentRing
from hil.service.status import ValveStatus
from hil.source.sample import LinkEvent, Sample
from recordings import read

NAP_S = 0.5
"""Between two looks into the queue [s]: items come in batches, so that waking up costs little. Health is judged no more
often."""

BATCH = 32
"""Samples after which others get their turn."""

Publish = Callable[[MonitorEvent], None]
"""Told of every event."""

NOTHING: Mapping[str, float] = MappingProxyType({})


class ValveLane:
    """One valve under watch.

    plan : what it is; link : the way to it; queue : its items; publish : see `Publish`; learned : told its detector;
    notes : of its recording, which gets the judgements.
    """

    def __init__(
        self,
        plan: ValvePlan,
        link: ValveLink,
        queue: ItemQueue,
        publish: Publish,
        learned: Callable[[str, Watch], None] = lambda tag, watch: None,
        notes: Notes | None = None,
    ) -> None:
        self.plan, self.link, self._queue, self._publish = plan, link, queue, publish
        self._learned, self._notes, self._busy = learned, notes, False
        self.monitor: Monitor = plan.monitor(on_learned=learned)
        self.standing = Standing.first()
        self.figures: InServiceFigures | None = None
        self.movements, self.newest_wall = Movements(plan), time.time()
        self.counts: Counter[str] = Counter()
        self.error = ""
        self._events = NewestEvents()
        self._alarm_text = ""
        names = {spec.name for spec in plan.signals}
        stroke, area = plan.known("stroke_m"), plan.known("diaphragm_area_m2")
        self._scale_m = stroke if "setpoint" in names and stroke else math.nan
        self._area = 1.0 if "force" in names else area if "pressure" in names and area else math.nan
        self._force = "force" if "force" in names else "pressure"
        self.ring = RecentRing(not math.isnan(self._scale_m), not math.isnan(self._area))

    @property
    def tag(self) -> str:
        """The valve's name."""
        return self.plan.tag

    @property
    def watch(self) -> ValveWatch:
        """What is held of the valve."""
        return self.monitor.valves[self.tag]

    @property
    def idle(self) -> bool:
        """Whether everything that came has been looked at."""
        return not (self._busy or len(self._queue))

    def forget(self) -> None:
        """Begin with nothing learned."""
        self.monitor = self.plan.monitor(on_learned=self._learned)

    async def run(self) -> None:
        """Detect until cancelled. Raises what detection raises; the item that it raised for is not seen again."""
        try:
            await self._prepare()
            while True:
                self._busy = True
                items = self._queue.take(BATCH)
                for item in items:
                    await self.take(item)
                self.error, self._busy = "", False
                await asyncio.sleep(0.0 if len(items) == BATCH else NAP_S)
        except Exception as error:
            self.error, self._busy = f"{type(error).__name__}: {error}", False
            raise

    async def _prepare(self) -> None:
        """Learn from the recordings that the plan names, unless it is known already."""
        plan = self.plan
        if self.watch.watch is None and plan.calibrate:
            recordings = [await asyncio.to_thread(read, path) for path in plan.calibrate]
            watch = await asyncio.to_thread(learn_recordings, recordings, plan.model, plan.false_alarms)
            self.monitor.resume({self.tag: (watch, None)})
            self.monitor.check()
            self._learned(self.tag, watch)

    async def take(self, item: Sample | LinkEvent) -> None:
        """One item of the valve."""
        event = await self._seen(item)
        if event is not None:
            self.counts[event.kind] += 1
            if event.kind == "alarm":
                self._alarm_text = event.text
            self._events.add(event)
            if self._notes is not None and event.judged:
                self._notes.add(Note(item.time, self.tag, event.kind, event.text))
            self._publish(event)

    async def _seen(self, item: Sample | LinkEvent) -> MonitorEvent | None:
        event = await self.monitor.take(item)
        measured, judgement = self.watch.measured, self.watch.judgement
        if isinstance(item, Sample) and measured is not None:
            values = measured.values
            self.ring.add(
                item.wall,
                values["position"],
                values.get("setpoint", math.nan) * self._scale_m,
                values.get(self._force, math.nan) * self._area,
                judgement.residual if judgement and judgement.verdict.used else math.nan,
                judgement.threshold if judgement and judgement.verdict.used else math.nan,
            )
            self.movements.add(measured)
            self.newest_wall = item.wall
        return event

    def judge(self, now: datetime, monotonic_s: float) -> None:
        """Look at the valve as a whole: how it stands now."""
        self.standing = self.standing.after(self._facts(monotonic_s), now)

    def _facts(self, now: float) -> ValveFacts:
        link, status = self.link, self.watch.status
        learned = status.so_far
        if self.plan.entry.learn_s:
            learned += f" of {self.plan.entry.learn_s:.0f} s"
        return ValveFacts(
            link.age_s(now), link.stale_s, link.connected, link.down, *link.unusable(now), self.error,
            status.phase, learned, status.load, status.fault, self._alarm_text, status.judged, status.supported,
        )  # fmt: skip

    def status(self, late: int) -> ValveStatus:
        """As others see it. late : deadlines missed on its source."""
        now, standing, watch = time.monotonic(), self.standing.worst, self.watch.status
        cause = standing.cause
        link = self.link.status(now, late)
        return ValveStatus(
            self.tag, cause.health, cause.reason, standing.since, cause.evidence, cause.check, link,
            self.figures, self._latest(link.age_s), self._events.all, watch.phase, watch.load,
        )  # fmt: skip

    def _latest(self, age_s: float) -> Mapping[str, float]:
        """The newest good values; none once they are stale, for nobody must take them for fresh."""
        measured, newest = self.watch.measured, self.link.newest
        if newest is None or not self.link.connected or age_s > self.link.stale_s:
            return NOTHING
        others = {name: one.value for name, one in newest.readings.items() if one.good}
        si = {name: value for name, value in (measured.values if measured else {}).items() if name in others}
        return MappingProxyType({**others, **{name: value for name, value in si.items() if math.isfinite(value)}})


def utc_now() -> datetime:
    """The wall clock."""
    return datetime.now(UTC)
