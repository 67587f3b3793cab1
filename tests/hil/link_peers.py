"""Peers for tests of the link: devices whose every answer is known, on TCP and on a pseudo terminal, harmed or not."""

from __future__ import annotations

import asyncio
import os
import ssl
import tty
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, TypeVar

from hil.modbus.framing import Frame, crc
from hil.testing import Send

Result = TypeVar("Result")

Answer = Callable[[int, int, int, int], "Sequence[int] | int | None"]
"""(unit, function, address, count) -> the words, an exception code, or None for silence."""

Harm = Callable[[bytes], Sequence[Any]]
"""A reply frame -> what the client gets to see: `Send`s and `Close`s in order."""


@dataclass
class Seen:
    """One request as it arrived. at : s of the event loop."""

    at: float
    unit: int
    function: int
    address: int
    count: int


class Device:
    """Answers requests and remembers them. truth : the words of the last request, right or exceptional; meant : the
    same by unit, function, address and count.
    """

    def __init__(self, answer: Answer, harm: Harm | None = None) -> None:
        self.answer, self.harm = answer, harm
        self.requests: list[Seen] = []
        self.truth: Sequence[int] | int | None = None
        self.meant: dict[tuple[int, int, int, int], Sequence[int] | int | None] = {}
        self.asked = asyncio.Event()

    def pdu(self, unit: int, pdu: bytes) -> bytes | None:
        """The reply to a request."""
        function, address, count = pdu[0], int.from_bytes(pdu[1:3], "big"), int.from_bytes(pdu[3:5], "big")
        self.requests.append(Seen(asyncio.get_running_loop().time(), unit, function, address, count))
        self.truth = words = self.meant[unit, function, address, count] = self.answer(unit, function, address, count)
        self.asked.set()
        if words is None:
            return None
        if isinstance(words, int):
            return bytes([function | 0x80, words])
        if function in (15, 16):
            return pdu[:5]
        if function in (1, 2):
            data = sum(bit << k for k, bit in enumerate(words)).to_bytes((count + 7) // 8, "little")
        else:
            data = b"".join(word.to_bytes(2, "big") for word in words)
        return bytes([function, len(data)]) + data

    def replies(self, frame: bytes) -> Sequence[Any]:
        """What the client gets to see of a reply frame."""
        return self.harm(frame) if self.harm else [Send(frame)]


class Queue:
    """Sends in order, as every real sender does: what is slow holds up what comes behind it."""

    def __init__(self, write: Callable[[bytes], None], close: Callable[[], None]) -> None:
        self._write, self._close, self._free_at = write, close, 0.0

    def put(self, actions: Sequence[Any]) -> None:
        loop = asyncio.get_running_loop()
        for action in actions:
            self._free_at = max(self._free_at, loop.time()) + getattr(action, "after", 0.0)
            work = (self._write, action.data) if isinstance(action, Send) else (self._close,)
            if self._free_at <= loop.time():
                work[0](*work[1:])
            else:
                loop.call_at(self._free_at, *work)


class TcpPeer(Device):
    """A device behind a loopback port; `start` may be called again after `stop` and takes the same port."""

    def __init__(self, answer: Answer, harm: Harm | None = None, context: ssl.SSLContext | None = None) -> None:
        super().__init__(answer, harm)
        self.port, self.n_connections, self._context = 0, 0, context
        self._connections: set[asyncio.Transport] = set()
        self._server: asyncio.Server | None = None

    async def start(self) -> TcpPeer:
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(lambda: _Connection(self), "127.0.0.1", self.port, ssl=self._context)
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def stop(self) -> None:
        if self._server is not None:
            self._server.close()
        self.drop()

    def drop(self) -> None:
        """Close every connection, and keep listening."""
        for transport in list(self._connections):
            transport.abort()

    async def __aenter__(self) -> TcpPeer:
        return await self.start()

    async def __aexit__(self, *_: object) -> None:
        await self.stop()


class _Connection(asyncio.Protocol):
    def __init__(self, peer: TcpPeer) -> None:
        self._peer, self._pending = peer, b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport, self._queue = transport, Queue(self._write, transport.abort)
        self._peer._connections.add(transport)
        self._peer.n_connections += 1

    def connection_lost(self, exc: Exception | None) -> None:
        self._peer._connections.discard(self._transport)

    def data_received(self, data: bytes) -> None:
        self._pending += data
        while len(self._pending) >= 6 and len(self._pending) >= 6 + int.from_bytes(self._pending[4:6], "big"):
            end = 6 + int.from_bytes(self._pending[4:6], "big")
            frame, self._pending = self._pending[:end], self._pending[end:]
            pdu = self._peer.pdu(frame[6], frame[7:])
            if pdu is not None:
                self._queue.put(self._peer.replies(Frame(int.from_bytes(frame[:2], "big"), frame[6], pdu).tcp()))

    def _write(self, data: bytes) -> None:
        if not self._transport.is_closing():
            self._transport.write(data)


class PtyPeer(Device):
    """A device on a pseudo terminal; `path` is what a client opens."""

    def __init__(self, answer: Answer, harm: Harm | None = None) -> None:
        super().__init__(answer, harm)

    async def __aenter__(self) -> PtyPeer:
        self._near, self._far = os.openpty()
        tty.setraw(self._near)
        tty.setraw(self._far)
        os.set_blocking(self._near, False)
        self.path, self._open, self._pending = os.ttyname(self._far), True, b""
        self._queue = Queue(self.write, self.unplug)
        asyncio.get_running_loop().add_reader(self._near, self._read)
        return self

    async def __aexit__(self, *_: object) -> None:
        self.unplug()

    def unplug(self) -> None:
        """Take the device away."""
        if self._open:
            self._open = False
            asyncio.get_running_loop().remove_reader(self._near)
            os.close(self._near)
            os.close(self._far)

    def write(self, data: bytes) -> None:
        """Put bytes on the line."""
        with suppress(BlockingIOError):
            if self._open:
                os.write(self._near, data)

    def _read(self) -> None:
        try:
            self._pending += os.read(self._near, 4096)
        except OSError:
            return
        while len(self._pending) >= 8:
            size = 9 + self._pending[6] if self._pending[1] in (15, 16) else 8
            frame, self._pending = self._pending[:size], self._pending[size:]
            assert crc(frame[:-2]) == frame[-2:], "a request with a wrong checksum"
            pdu = self.pdu(frame[0], frame[1:-2])
            if pdu is not None:
                self._queue.put(self.replies(Frame(0, frame[0], pdu).rtu()))


async def within(awaitable: Awaitable[Result], seconds: float = 20.0) -> Result:
    """A result that must come; the time only ends a test that hangs."""
    async with asyncio.timeout(seconds):
        return await awaitable


class VirtualTime(asyncio.SelectorEventLoop):
    """An event loop whose clock jumps to the next timer instead of waiting: exact timing, at any load of the machine.

    Nothing but timers may be waited for in it.
    """

    def __init__(self) -> None:
        super().__init__()
        self._now = 0.0
        selector: Any = self._selector  # type: ignore[attr-defined]
        look = selector.select

        def jump(timeout: float | None = None) -> Any:
            assert timeout is not None, "everybody waits, and no timer is set"
            self._now += max(timeout, 0.0)
            return look(0)

        selector.select = jump

    def time(self) -> float:
        return self._now


def in_virtual_time(work: Coroutine[Any, Any, Result]) -> Result:
    """Run something on the virtual clock."""
    with asyncio.Runner(loop_factory=VirtualTime) as runner:
        return runner.run(work)


class MemoryLine(asyncio.Transport):
    """A serial transport without a line: the requests of a protocol go to a device, its replies come back.

    travel : how long a request takes to arrive [s]; deliver : puts bytes on the line towards the protocol.
    """

    in_waiting = 0

    def __init__(self, protocol: asyncio.Protocol, device: Device, travel: float) -> None:
        super().__init__()
        self.sync_serial = self
        self._device, self._travel, self._loop = device, travel, asyncio.get_running_loop()
        self.deliver = protocol.data_received
        self._queue = Queue(self.deliver, lambda: None)

    def write(self, data: bytes) -> None:
        self._loop.call_later(self._travel, self._arrive, data)

    def close(self) -> None:
        pass

    def _arrive(self, data: bytes) -> None:
        pdu = self._device.pdu(data[0], data[1:-2])
        if pdu is not None:
            self._queue.put(self._device.replies(Frame(0, data[0], pdu).rtu()))
