"""What the wire library's servers leave open: requests that arrive together, peers that lost the thread.

The library looks at one request per arrival and forgets the rest, and after half a frame it waits for the other half,
swallowing good requests as if they were it. Here a connection's requests are cut apart and served in turn, a connection
that does not speak Modbus is closed, and a serial line forgets what came before a silence, as the standard wants it.
"""

from __future__ import annotations

import asyncio
import logging
import ssl
from collections.abc import Callable, Collection
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler

from hil.modbus.framing import FrameHeader
from hil.modbus.terminals import TerminalError

ALLOWED = frozenset({1, 2, 3, 4, 5, 6, 15, 16, 22, 23})
"""Function codes that read or write registers; all others (diagnostics, files, restarts) are refused."""

SILENCE = 0.05
"""A pause in a request on a serial line longer than this [s] is its end: 3.5 characters, and what adapters add."""

REOPEN = 0.5
"""How often a lost serial line is tried again [s]."""

_LOG = logging.getLogger(__name__)


def _open_files() -> int:
    """How many files this process may have open."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows sets no such limit
        return 512
    return resource.getrlimit(resource.RLIMIT_NOFILE)[0]


MOST_CONNECTIONS = min(128, _open_files() // 2)
"""Connections of a server, on all its listeners. One more takes the place of the one that has been silent for longest:
idle clients never shut a polling one out, and descriptors never run out.
"""

IDLE_S = 300.0
"""A connection that asks nothing for so long is closed."""

HANDSHAKE_S = 10.0
"""What a client has for its TLS handshake."""

PATIENCE = 1 << 16
"""Bytes of unanswered requests or unread answers with which a peer is dropped."""


class _Guard(ServerRequestHandler):
    """What a connection and a serial line have in common: whom they let through."""

    def __init__(self, server: Any, units: Collection[int], clock: Callable[[], float]) -> None:
        super().__init__(server, None, self._look, None)  # type: ignore[no-untyped-call]
        self.units, self.clock = units, clock

    def _look(self, sending: bool, pdu: ModbusPDU) -> ModbusPDU:
        """Let through what a unit of ours is asked and may be asked."""
        if sending or (pdu.dev_id in self.units and pdu.function_code in ALLOWED):
            return pdu
        return _Refused(pdu, pdu.dev_id in self.units)


class Room:
    """The connections of one server, be they on different listeners or still in their handshake."""

    def __init__(self) -> None:
        self._taken: set[_Connection] = set()

    def enter(self, one: _Connection) -> None:
        """Take a place; the connection that has been silent for longest goes where there is none."""
        if len(self._taken) >= MOST_CONNECTIONS:
            min(self._taken, key=lambda other: other.heard_at).close()
        self._taken.add(one)

    def leave(self, one: _Connection) -> None:
        """Give the place back; a second time does nothing."""
        self._taken.discard(one)


class _Connection(_Guard):
    """A connection on TCP or TLS: requests in turn, however they arrive."""

    heard_at = 0.0
    _waiting = b""
    _busy = False
    _socket: asyncio.Transport | None = None
    _idle: asyncio.TimerHandle | None = None
    _handshake: asyncio.Task[None] | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has connected; where there is TLS its handshake comes first."""
        assert isinstance(transport, asyncio.Transport)
        self._socket = transport
        self.heard_at = self.loop.time()
        self._idle = self.loop.call_later(IDLE_S, self._close_when_idle)
        self.server.room.enter(self)
        if self.server.tls is None:
            super().connection_made(transport)
        else:
            self._handshake = self.loop.create_task(self._secure(transport, self.server.tls))

    async def _secure(self, transport: asyncio.Transport, tls: ssl.SSLContext) -> None:
        try:
            async with asyncio.timeout(HANDSHAKE_S):
                secured = await self.loop.start_tls(transport, self, tls, server_side=True)
        except OSError as error:  # that of TLS, and that of a time that is over, are such
            _LOG.debug("a handshake failed: %s", error)
            self.close()
            return
        assert secured is not None
        super().connection_made(secured)
        self._serve_next()

    def connection_lost(self, reason: Exception | None) -> None:
        """The client has gone, or was sent away."""
        self._end()
        super().connection_lost(reason)

    def close(self, reconnect: bool = False) -> None:
        """Send the client away."""
        insecure = self._socket if self.transport is None else None
        self._end()
        super().close(reconnect)
        if insecure is not None:
            insecure.abort()

    def _end(self) -> None:
        self.server.room.leave(self)
        if self._idle is not None:
            self._idle.cancel()
        if self._handshake is not None and self._handshake is not asyncio.current_task():
            self._handshake.cancel()

    def _close_when_idle(self) -> None:
        left = self.heard_at + IDLE_S - self.loop.time()
        if left > 0:
            self._idle = self.loop.call_later(left, self._close_when_idle)
        else:
            self.close()

    def data_received(self, data: bytes) -> None:
        """Bytes from the peer, cut anywhere."""
        self.heard_at = self.loop.time()
        self._waiting += data
        unread = self.transport.get_write_buffer_size() if self.transport else 0  # type: ignore[attr-defined]
        if max(len(self._waiting), unread) > PATIENCE:
            self.close()
        self._serve_next()

    def server_send(self, pdu: ModbusPDU | None, addr: Any) -> None:
        """Answer, and turn to the next request."""
        super().server_send(pdu, addr)  # type: ignore[no-untyped-call]
        self._busy = False
        self.loop.call_soon(self._serve_next)

    def _serve_next(self) -> None:
        if self._busy or not self.transport or (header := FrameHeader.at(self._waiting)) is None:
            return
        if header.problem:
            self.close()
        elif len(self._waiting) >= header.size:
            frame, self._waiting = self._waiting[: header.size], self._waiting[header.size :]
            self._busy = True
            super().data_received(frame)


class _Line(_Guard):
    """A serial line: one request at a time, and what is said to and by other devices."""

    _last = float("-inf")

    def data_received(self, data: bytes) -> None:
        """Bytes from the line, cut anywhere."""
        now = self.clock()
        if now - self._last > SILENCE:
            self.recv_buffer = b""
        self._last = now
        super().data_received(data)

    def callback_disconnected(self, exc: Exception | None) -> None:
        """The line went away (an adapter was unplugged); without a reason it is the server that stops."""
        super().callback_disconnected(exc)
        if exc is not None:
            self.server.lost(exc)

    def server_send(self, pdu: ModbusPDU | None, addr: Any) -> None:
        """Answer, unless another device on the line was asked."""
        if pdu is not None and pdu.dev_id in self.units:
            super().server_send(pdu, addr)  # type: ignore[no-untyped-call]


class _Refused(ModbusPDU):
    """Stands in for a request that is not looked at."""

    def __init__(self, pdu: ModbusPDU, known_unit: bool) -> None:
        super().__init__(dev_id=pdu.dev_id, transaction_id=pdu.transaction_id)
        self.function_code = pdu.function_code & 0x7F
        self._known_unit = known_unit

    async def datastore_update(self, context: object, device_id: int) -> ModbusPDU:
        """A refusal; of a unit that is not there, silence on a line and a gateway's answer on TCP."""
        if not self._known_unit:
            raise NoSuchIdException(str(device_id))
        return ExceptionResponse(self.function_code, ExcCodes.ILLEGAL_FUNCTION)


class _Careful:
    """Goes in front of one of the library's servers. units : the ids that are served; clock : monotonic [s]; room : of
    the connections; tls : what a server shows, None for none.
    """

    handler: type[_Guard] = _Connection

    def __init__(
        self,
        *what: Any,
        units: Collection[int],
        clock: Callable[[], float],
        room: Room | None = None,
        tls: ssl.SSLContext | None = None,
        **more: Any,
    ) -> None:
        self._units, self._clock = units, clock
        self.room, self.tls = room or Room(), tls
        super().__init__(*what, **more)

    def callback_new_connection(self) -> _Guard:
        """The library asks for a handler of a connection."""
        return self.handler(self, self._units, self._clock)


class CarefulTcpServer(_Careful, ModbusTcpServer):
    """Modbus TCP, and Modbus/TCP Security where there is `tls`: the library's own server for it swallows two requests
    that arrive together, and does not see clients that never end their handshake.
    """


class CarefulSerialServer(_Careful, ModbusSerialServer):
    """Modbus RTU, on a line that may go away and come back."""

    handler = _Line
    _reopening: asyncio.Task[None] | None = None

    def lost(self, why: Exception) -> None:
        """Open the line again as soon as that is possible."""
        if self._reopening is None:
            _LOG.warning("the serial line is lost (%s); trying again until it is back", why)
            self._reopening = asyncio.create_task(self._reopen())

    async def _reopen(self) -> None:
        while not await self._listens():
            await asyncio.sleep(REOPEN)
        self._reopening = None

    async def _listens(self) -> bool:
        try:
            return await self.listen()
        except TerminalError:  # a device that is half gone
            return False

    async def shutdown(self) -> None:
        """Stop."""
        if self._reopening is not None:
            self._reopening.cancel()
        await super().shutdown()  # type: ignore[no-untyped-call]
