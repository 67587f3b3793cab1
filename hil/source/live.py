"""A source over a live link: a task that keeps the connection, a task that polls, and a watch over both."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Protocol, Self

from hil.client.transport import LiveAddress
from hil.modbus.messages import WRITE_COILS, WRITE_REGISTERS, Reply, ReplyFault, Request
from hil.registers.codec import encode
from hil.registers.point import BIT_TABLES
from hil.registers.register_map import WriteMap
from hil.source.channel import Channel
from hil.source.line import DeviceLine
from hil.source.sample import EventKind, LinkEvent, Sample, wall_at
from hil.source.statistics import Statistics
from hil.source.valve import Valve
from recordings import BadInput, LinkError, ProtocolError, SignalSpec


class PollingStopped(LinkError):
    """A task of a source ended, which it never should: no more samples will come. The cause is `__cause__`.

    It is a `LinkError`: catch that to be ready for a lost link and for this.
    """


class ReadingPlan(Protocol):
    """How a source reads its valves; `Polling` and `RingReading` are the two."""

    def signals(self, valve: Valve) -> tuple[SignalSpec, ...]:
        """What a recording of the valve declares, time first."""

    def check(self, valve: Valve) -> None:
        """Raise BadInput when the plan does not fit the valve's map."""

    async def run(self, valves: Sequence[Valve], line: DeviceLine, channel: Channel, statistics: Statistics) -> None:
        """Read until cancelled."""


class LiveSource:
    """Samples of one or several valves behind one address, and events about the link to them.

    Use it as an asynchronous context manager and iterate over it: it yields `Sample`s and `LinkEvent`s until it is
    left. Between `link_down` and `link_up` of a valve it yields no samples of it.

    address : of the peer; valves : what to read, each name once; plan : how; write_map, allow_write : both must be
    given before `write` changes anything; without them not one write request can leave.

    Raises BadInput for valves that cannot be read so, and as `Link` does. Iterating raises `PollingStopped`.
    """

    def __init__(
        self,
        address: LiveAddress,
        valves: Sequence[Valve],
        plan: ReadingPlan,
        *,
        write_map: WriteMap | None = None,
        allow_write: bool = False,
    ) -> None:
        for valve in valves:
            plan.check(valve)
        self.signals: Mapping[str, tuple[SignalSpec, ...]] = {valve.name: plan.signals(valve) for valve in valves}
        self.statistics = Statistics()
        self.address = address
        self._valves, self._plan = tuple(valves), plan
        self._channel = Channel()
        self._write_map, allowed = write_map, allow_write and write_map is not None
        self._line = DeviceLine(address, valves, self._announce, allow_write=allowed)
        self.statistics.faults = self._line.link.tally
        self._tasks: list[asyncio.Task[None]] = []

    async def __aenter__(self) -> Self:
        reading = self._plan.run(self._valves, self._line, self._channel, self.statistics)
        for name, work in (("link", self._line.link.run()), ("polling", reading)):
            task = asyncio.create_task(work, name=name)
            task.add_done_callback(self._ended)
            self._tasks.append(task)
        return self

    async def __aexit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        tasks, self._tasks = self._tasks, []
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._channel.finish(StopAsyncIteration())  # whoever still waits for a sample

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> Sample | LinkEvent:
        return await self._channel.get()

    async def write(self, valve: str, name: str, value: float) -> None:
        """Write one point of the write map to a valve, and wait until the device has confirmed it.

        Raises BadInput when writing was not allowed, there is no such valve or point, the point cannot carry the value,
        or the device refuses it; LinkError when the device does not answer, ProtocolError when its answer cannot be
        used. It may have been written all the same then.
        """
        if not self._line.link.allow_write or self._write_map is None:
            remedy = "give a write map and allow writing, if you mean it"
            raise BadInput(self.address.text, "this source only reads", remedy)
        unit = self._unit(valve)
        point = self._write_map.on_unit(unit).point(name)
        words = tuple(encode(point, value))
        function = WRITE_COILS if point.table in BIT_TABLES else WRITE_REGISTERS
        reply = await self._line.ask(Request(unit, function, point.address, len(words), words))
        if reply.fault is not None:
            raise _unconfirmed(f"{self.address.text}: {valve}: {name}", reply)

    def _unit(self, valve: str) -> int:
        """The device id that commands of a valve go to, the first of those it is read from."""
        for one in self._valves:
            if one.name == valve:
                return one.units[0]
        names = ", ".join(one.name for one in self._valves)
        raise BadInput(self.address.text, f"there is no valve '{valve}'", f"there are {names}")

    def _announce(self, valve: str, kind: EventKind, text: str) -> None:
        now = asyncio.get_running_loop().time()
        self._channel.put(LinkEvent(now, wall_at(now), valve, kind, text))

    def _ended(self, task: asyncio.Task[None]) -> None:
        """A task is over: never in silence, unless the source is being closed."""
        if task not in self._tasks:
            return
        cause = asyncio.CancelledError() if task.cancelled() else task.exception()
        if isinstance(cause, BadInput):
            self._channel.finish(cause)
            return
        reason = f"{type(cause).__name__}: {cause}" if cause else "it returned"
        text = f"the {task.get_name()} task ended: {reason}"
        for valve in self._valves:
            self._announce(valve.name, "link_down", text)
        stopped = PollingStopped(f"{self.address.text}: {text}")
        stopped.__cause__ = cause
        self._channel.finish(stopped)


def _unconfirmed(where: str, reply: Reply) -> BadInput | LinkError:
    """The error of a write whose reply has a fault."""
    if reply.fault is ReplyFault.EXCEPTION and not reply.device_silent:
        return BadInput(where, reply.text, "check the device, and whether it lets this register be written")
    kind = LinkError if reply.device_silent or reply.fault is ReplyFault.LOST else ProtocolError
    return kind(f"{where}: {reply.text}")
