"""A plain client for tests: one point read or written by name, over the line, with all that may go wrong on it."""

from __future__ import annotations

import asyncio
from collections import Counter
from types import TracebackType
from typing import Self, overload

from hil.client.transport import LinkSide, LiveAddress
from hil.client.wire import Wire
from hil.modbus.checks import transactions
from hil.modbus.messages import WRITE_COILS, WRITE_REGISTERS, Reply, ReplyFault, Request
from hil.modbus.terminals import TerminalError
from hil.registers.codec import encode
from hil.registers.point import BIT_TABLES, Point
from hil.registers.register_map import RegisterMap, WriteMap, grouped
from hil.running import LoopThread
from hil.source.address import parse_address
from hil.source.valve import BlockRead
from recordings import BadInput, LinkError


class Device:
    """A valve as a client sees it, for synchronous programs: ``read("position")``, ``write("setpoint", 0.3)``.

    Each call is one exchange and returns or raises at once: nothing is repeated, and a connection that was lost is
    opened anew by the next call. So the same faults of a line always do the same, which a test needs and a plant does
    not: there, use `open_source`. Context manager.

    Parameters
    ----------
    address : str
        As for `open_source`.
    register_map, write_map : RegisterMap, WriteMap or None
        What can be read and written.
    timeout_s : float, optional
        How long a reply is waited for [s]; that of the address when not given.
    """

    def __init__(
        self, address: str, register_map: RegisterMap, write_map: WriteMap | None = None, timeout_s: float | None = None
    ) -> None:
        where = parse_address(address)
        if not isinstance(where, LiveAddress):
            raise BadInput(address, "it is no device", "give the address of a live one, such as tcp://127.0.0.1:5020")
        self._address, self._opening = where, where.opening()
        self._map, self._write_map, self._timeout_s = register_map, write_map, timeout_s or where.timeout
        self._side = LinkSide(transactions(), Counter(), self._lost)
        self._wire: Wire | None = None
        self._thread: LoopThread | None = None

    def __enter__(self) -> Self:
        self._thread = LoopThread("bristle device")
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._thread is not None:
            self._thread.run(self._close())
            self._thread.close()

    @overload
    def read(self, name: str) -> float: ...
    @overload
    def read(self) -> dict[str, float]: ...
    def read(self, name: str | None = None) -> float | dict[str, float]:
        """The value of a point in the unit of the map, or of all points by name.

        Raises LinkError when there is no reply that can be used, BadInput for a point that is not there or not good.
        """
        points = self._map.points if name is None else (self._map.point(name),)
        values: dict[str, float] = {}
        for block in grouped(points, self._map.max_hole, self._map.max_read):
            asked = BlockRead(block)
            for point, reading in asked.readings(self._ask(asked.request)).items():
                if name is not None and not reading.good:
                    found = reading.reason or "it is not good"
                    raise BadInput(f"{self._address.text}: {name}", found, "check the map and the device")
                values[point] = reading.value
        return values if name is None else values[name]

    def write(self, name: str, value: float) -> None:
        """Write a point, and wait until the device has confirmed it.

        Raises LinkError when it does not (it may have been written all the same), BadInput when the device refuses it
        or nothing can be written.
        """
        if self._write_map is None:
            raise BadInput(self._address.text, "there is no write map", "give one, if writing is meant")
        point: Point = self._write_map.point(name)
        words = tuple(encode(point, value))
        function = WRITE_COILS if point.table in BIT_TABLES else WRITE_REGISTERS
        self._ask(Request(point.unit_id, function, point.address, len(words), words))

    def _ask(self, request: Request) -> Reply:
        if self._thread is None:
            raise BadInput(self._address.text, "it is not open", "use it in a with block")
        reply = self._thread.run(self._exchange(request))
        if reply.fault is ReplyFault.EXCEPTION and not reply.device_silent:
            raise BadInput(self._address.text, reply.text, "check the device, the address and the value")
        if reply.fault is not None:
            raise LinkError(f"{self._address.text}: {reply.text}")
        return reply

    async def _exchange(self, request: Request) -> Reply:
        try:
            if self._wire is None:
                async with asyncio.timeout(self._timeout_s):
                    self._wire = await self._opening(self._side)
        except (OSError, TerminalError) as error:
            return Reply(fault=ReplyFault.LOST, text=str(error) or "no connection")
        wire = self._wire
        reply = await wire.exchange(request)
        if reply.fault in (ReplyFault.LOST, ReplyFault.FRAMING):
            await self._close()
        return reply

    def _lost(self, _error: Exception | None) -> None:
        self._wire = None

    async def _close(self) -> None:
        wire, self._wire = self._wire, None
        if wire is not None:
            wire.close()
