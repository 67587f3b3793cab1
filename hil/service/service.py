"""The monitor as a service: every part a supervised task, with bounded queues between them.

Acquisition has a thread and an event loop of its own, so that nothing else can delay it. Detection, state and the
outlets share a second loop; disk, figures and state files have a thread each. `status` and `recent` may be called from
any thread.
"""

from __future__ import annotations

import asyncio
import logging
import sys
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

from detector import Watch, described
from hil.monitor.event import MonitorEvent
from hil.running import LoopThread, freeze_garbage
from hil.service.acquisition import Acquisition, ItemQueue, ValveLink
from hil.service.in_service.window import prepare
from hil.service.keeping import StateFolder
from hil.service.lane import ValveLane, utc_now
from hil.service.outlets.metrics import MetricsServer
from hil.service.outlets.notify import Notifier
from hil.service.outlets.sink import EventSink, SinkTask
from hil.service.plan import ServicePlan
from hil.service.queue import BoundedQueue
from hil.service.recording import ValveRecording
from hil.service.status import PlantStatus, RecentSamples, TaskStatus
from hil.service.supervision import SupervisedTask

WAITING = 3000
"""Items that may wait for detection or for the disk, of each valve: 5 min at 10 Hz, 30 s at 100 Hz; 8 MB."""

JUDGE_S, SAVE_S, FIGURES_LOOK_S, LOOK_S = 0.25, 60.0, 1.0, 0.05
DRAIN_S = 10.0
"""At the end: what was read already is looked at, written and told, unless nothing of it goes on for so long [s]."""

SWITCH_S = 1e-3
"""How long the acquisition waits at most for another thread to let it run [s]; Python's own 5 ms would be half a period
at 100 Hz."""

LOG = logging.getLogger("bristle.monitor")

ServiceTask = Callable[[], Awaitable[object]]
"""More work beside the service, a page for example: makes a coroutine that runs until it is cancelled."""


@dataclass(frozen=True)
class ServiceOutlets:
    """Where findings go. sinks : for events; metrics : host and port, None for none."""

    sinks: Sequence[EventSink] = ()
    metrics: tuple[str, int] | None = None


class _Left(NamedTuple):
    """What has still to be done at the end: valves that are not looked through, items that wait, recordings that are
    not closed, samples in them that are not on the disk, and events that are not told.
    """

    unseen: int
    waiting: int
    recording: int
    unsafe: int
    untold: int

    @property
    def any(self) -> bool:
        """Whether there is something."""
        return self != (0, 0, 0, 0, 0)

    @property
    def words(self) -> str:
        """What is given up with it."""
        return (
            f"{self.recording} recordings are not closed, {self.unsafe} samples that were read are not recorded, "
            f"{self.untold} events are not told; recovering a recording keeps what was acknowledged"
        )


class Service:
    """Watches the valves of a plan until told to stop.

    Raises BadInput when the folders for state or recordings cannot be written.
    """

    def __init__(self, plan: ServicePlan, outlets: ServiceOutlets | None = None) -> None:
        outlets = outlets or ServiceOutlets()
        self.plan, self.alarms = plan, 0
        plant = plan.plant
        self._state = StateFolder(plant.path(plant.state))
        self._ending = asyncio.Event()
        self._disk, self._aside = ThreadPoolExecutor(1, "disk"), ThreadPoolExecutor(1, "figures")
        self._keeper = ThreadPoolExecutor(1, "state")
        self._sinks = [SinkTask(sink) for sink in outlets.sinks]
        self._lanes: dict[str, ValveLane] = {}
        self._recordings: dict[str, ValveRecording] = {}
        self._late: dict[str, Acquisition] = {}
        self._acquired, self._tasks = list[SupervisedTask](), list[SupervisedTask]()
        self._queues: list[ItemQueue] = []
        for source in plan.sources:
            links = {valve.tag: self._prepared(valve.tag, source.shown, source.rate_hz) for valve in source.valves}
            acquisition = Acquisition(source, links)
            self._late |= dict.fromkeys(links, acquisition)
            self._acquired.append(SupervisedTask(f"acquisition {source.shown}", acquisition.run))
        self._tasks += [SupervisedTask(task.sink.name, task.run, _dropped(task.queue)) for task in self._sinks]
        self._tasks += [
            SupervisedTask("health", self._judge), SupervisedTask("state", self._save_again_and_again),
            SupervisedTask("figures", self._figure),
        ]  # fmt: skip
        self.metrics = None if outlets.metrics is None else MetricsServer(self, *outlets.metrics)
        if self.metrics is not None:
            self._tasks.append(SupervisedTask("metrics", self.metrics.run))
        self._heard_at = time.monotonic()
        self._notifier = Notifier()
        self._thread: LoopThread | None = None

    def _prepared(self, tag: str, source: str, rate_hz: float) -> ValveLink:
        """The link, the lane and the recording of a valve, with their queues."""
        plan = next(valve for valve in self.plan.valves if valve.tag == tag)
        watched: ItemQueue = BoundedQueue(WAITING)
        queues, entry, notes = [watched], self.plan.plant.recordings, None
        if entry is not None:
            stored: ItemQueue = BoundedQueue(WAITING)
            queues.append(stored)
            folder = self.plan.plant.path(entry.folder)
            recording = ValveRecording(plan, entry, folder, stored, self._disk, self._ending)
            self._recordings[tag], notes = recording, recording.notes
            self._tasks.append(SupervisedTask(f"recording {tag}", recording.run, _unrecorded(stored, recording)))
        self._queues += queues
        link = ValveLink(tag, source, rate_hz, queues)
        lane = ValveLane(plan, link, watched, self._publish, self._learned, notes)
        self._lanes[tag] = lane
        self._tasks.append(SupervisedTask(f"detection {tag}", lane.run, _dropped(watched)))
        return link

    def status(self) -> PlantStatus:
        """How everything stands now."""
        valves = tuple(lane.status(self._late[tag].missed) for tag, lane in self._lanes.items())
        tasks: tuple[TaskStatus, ...] = tuple(task.status for task in (*self._acquired, *self._tasks))
        return PlantStatus(self.plan.plant.name, utc_now(), valves, tasks)

    def recent(self, tag: str) -> RecentSamples:
        """The newest samples of a valve. Raises KeyError for a tag that there is not."""
        return self._lanes[tag].ring.samples()

    def counts(self, tag: str) -> dict[str, int]:
        """Events of a valve so far, by kind."""
        return dict(self._lanes[tag].counts)

    def recorded(self, tag: str) -> int | None:
        """Samples of a valve that are safe on the disk; None where nothing is recorded."""
        return self._recordings[tag].safe if tag in self._recordings else None

    async def run(self, stop: asyncio.Event, more: Mapping[str, ServiceTask] | None = None) -> None:
        """Watch until `stop` is set, or every source was a recording and has ended. more : see `ServiceTask`, by name.

        Raises BadInput when the state cannot be saved at the end.
        """
        for tag, lane in self._lanes.items():
            if self._state.resume(lane):
                LOG.info("%s: resumed from %s", tag, self._state.detector_file(tag))
        self._tasks += [SupervisedTask(name, work) for name, work in (more or {}).items()]
        sys.setswitchinterval(SWITCH_S)
        freeze_garbage()
        work = [asyncio.create_task(task.run(), name=task.name) for task in self._tasks]
        self._thread = LoopThread("acquisition")
        try:
            reading = [self._thread.start(task.run()) for task in self._acquired]
            self._notifier.ready(self._words())
            await self._until(stop)
            self._notifier.stopping()
            await self._drained(reading, stop)
        finally:
            self._thread.close()
            for one in work:
                one.cancel()
            await asyncio.gather(*work, return_exceptions=True)
            await self._save()
            self._close()

    async def _until(self, stop: asyncio.Event) -> None:
        """Until told to stop, or nothing is left to read."""
        while not (stop.is_set() or all(task.ended for task in self._acquired)):
            with suppress(TimeoutError):
                await asyncio.wait_for(stop.wait(), JUDGE_S)

    async def _drained(self, reading: Sequence[asyncio.Task[None]], stop: asyncio.Event) -> None:
        """Stop reading, and let what was read be looked at, written and told. Once `stop` is set it need not be all: a
        slow disk gets the time that it takes, one that takes nothing does not hold up the end.
        """
        assert self._thread is not None

        async def cancel() -> None:
            for one in reading:
                one.cancel()
            await asyncio.gather(*reading, return_exceptions=True)

        await asyncio.to_thread(self._thread.run, cancel())
        patience, before = DRAIN_S, None
        while (left := self._left()).any:
            if all(lane.idle for lane in self._lanes.values()):  # what is judged of the last samples is recorded, too
                self._ending.set()
            patience, before = (patience if left == before else DRAIN_S), left
            if patience <= 0.0:
                LOG.warning("it ends after %g s in which nothing went on: %s", DRAIN_S, left.words)
                break
            await asyncio.sleep(LOOK_S)
            patience -= LOOK_S if stop.is_set() else 0.0
        await self._judge_once()

    def _left(self) -> _Left:
        """What has still to be done of what was read."""
        recording = sum(task.running for task in self._tasks if task.name.startswith("recording "))
        unsafe = sum(one.unsafe for one in self._recordings.values())
        unseen = sum(not lane.idle for lane in self._lanes.values())
        return _Left(unseen, sum(map(len, self._queues)), recording, unsafe, sum(sink.waiting for sink in self._sinks))

    def _publish(self, event: MonitorEvent) -> None:
        self.alarms += event.kind == "alarm"
        for sink in self._sinks:
            sink.queue.put(event)

    def _learned(self, tag: str, watch: Watch) -> None:
        for line in described(watch).splitlines():
            LOG.info("%s: %s", tag, line)

    async def _judge(self) -> None:
        """Health of every valve, and a sign of life as long as the acquisition gives one."""
        told = -1e9
        while True:
            await self._judge_once()
            if self._thread is not None:
                self._thread.soon(self._heard)
            watchdog, now = self._notifier.watchdog_s, time.monotonic()
            if watchdog is not None and now - told > watchdog / 4 and now - self._heard_at < watchdog / 2:
                self._notifier.alive(self._words())
                told = now
            await asyncio.sleep(JUDGE_S)

    async def _judge_once(self) -> None:
        now, monotonic = utc_now(), time.monotonic()
        for lane in self._lanes.values():
            lane.judge(now, monotonic)

    def _heard(self) -> None:
        self._heard_at = time.monotonic()

    def _words(self) -> str:
        health = self.status().health
        return f"{len(self._lanes)} valves, worst: {health.value}"

    async def _figure(self) -> None:
        """In-service figures: of each valve when its window is full or old, one after the other."""
        loop, looked = asyncio.get_running_loop(), dict.fromkeys(self._lanes, time.monotonic())
        await loop.run_in_executor(self._aside, prepare)
        while True:
            await asyncio.sleep(FIGURES_LOOK_S)
            for tag, lane in self._lanes.items():
                due = time.monotonic() - looked[tag] >= self.plan.plant.figures_every_s
                if due or lane.movements.full:
                    looked[tag] = time.monotonic()
                    rows = lane.movements.window()
                    at = lane.newest_wall  # a recording that is played back has a time of its own
                    lane.figures = await loop.run_in_executor(self._aside, lane.movements.figures, rows, at)

    async def _save_again_and_again(self) -> None:
        while True:
            await asyncio.sleep(SAVE_S)
            await self._save()

    async def _save(self) -> None:
        loop = asyncio.get_running_loop()
        for lane in self._lanes.values():
            await loop.run_in_executor(self._keeper, self._state.save, lane)

    def _close(self) -> None:
        for sink in self._sinks:
            sink.close()
        for thread in (self._disk, self._aside, self._keeper):
            thread.shutdown(wait=False, cancel_futures=True)


def _dropped(queue: BoundedQueue[Any]) -> Callable[[], int]:
    return lambda: queue.dropped


def _unrecorded(queue: ItemQueue, recording: ValveRecording) -> Callable[[], int]:
    return lambda: queue.dropped + recording.lost
