"""Requests on a Modbus RTU line, told apart by silence.

RTU has no transaction ids: a late or repeated reply looks like the answer to the next request, and silence is the only
proof that there is none. Let `quiet` be longer than any reply is late (counted from the timeout) and longer than any
repetition lags behind its original. Then:

1. A request is sent only into silence. After a timeout or any other fault the line is left alone until nothing has come
   for `quiet`; bytes that came while nobody waited are such a fault, they are never skipped.
2. A reply counts only if the line stays silent behind it. If a stray frame took its place, the true reply follows
   within the device's usual time to answer, and both are dropped. So the silence is awaited until the longest usual
   time to the first byte and a quarter more has passed since the request, and at least for the 3.5 characters of the
   standard: no loss of time where a reply takes longer than that anyway.
3. Behind each reply of a unit that is new or has misbehaved the silence lasts longer, until ten in a row were clean:
   ten times its usual time to answer, at least 50 ms and at most `quiet`. No stray frame that is due by then can reach
   the request after its own.

What remains is a repetition that comes after ten clean replies, lags by more than the usual time to answer, and meets
a request whose own reply is lost. A heartbeat register among the values shows even that.
"""

from __future__ import annotations

import asyncio
import os
from collections import Counter
from dataclasses import dataclass
from typing import cast

from pymodbus.transport.serialtransport import SerialTransport

from hil._checks import Fault, Reply, Request
from hil._link_frames import check_rtu, rtu_frame
from hil._link_wire import GONE, Lost

CLEAN_REPLIES = 10
MARGIN = 1.25
SHORTEST_WATCH_S = 0.05


@dataclass
class _Trust:
    """One unit's manners: its longest usual time to a first byte [s], and its clean replies in a row."""

    first_byte: float = 0.0
    clean: int = 0  # nobody is trusted at first

    def silence(self, shortest: float, quiet: float) -> float:
        """How long the line must be silent behind a reply [s]."""
        if self.first_byte == 0.0:
            return quiet
        if self.clean >= CLEAN_REPLIES:
            return shortest
        return max(shortest, min(quiet, max(10 * self.first_byte, SHORTEST_WATCH_S)))

    def learn(self, first_byte: float) -> None:
        self.first_byte = max(first_byte, 0.95 * self.first_byte)


class _SerialLine(SerialTransport):
    """pymodbus' serial transport, reading the descriptor itself.

    pyserial asks `select` first, which knows no descriptor above 1023: with many connections in the process a line
    would be deaf, and its reader called again and again for ever.
    """

    def intern_read_ready(self) -> None:
        """Called by the event loop when there are bytes, or the device has gone."""
        try:
            data = os.read(self.sync_serial.fileno(), 4096)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            self.close(exc=error)
            return
        if data:
            self.intern_protocol.data_received(data)  # type: ignore[attr-defined]
        else:
            self.close(exc=OSError("the device has gone"))


class RtuWire(asyncio.Protocol):
    """Requests on a serial line.

    timeout : s to wait for a reply; quiet : s of silence that no stray reply exceeds; gap : s, the 3.5 characters of
    the standard; tally, lost : as in `TcpWire`.
    """

    def __init__(self, timeout: float, quiet: float, gap: float, tally: Counter[str], lost: Lost) -> None:
        self._timeout, self._quiet, self._gap, self._tally, self._lost = timeout, quiet, gap, tally, lost
        self._loop = asyncio.get_running_loop()
        self._transport: SerialTransport | None = None
        self._line, self._request = b"", cast("Request | None", None)
        self._answer: asyncio.Future[Reply]
        self._silent_from = self._first_byte_at = 0.0  # the line may speak until then; when a reply began
        self._trust: dict[int, _Trust] = {}
        self._ready = asyncio.Event()
        self._strayed = False  # since the request under way was sent

    async def open(self, device: str, baud: int, parity: str, stop: int) -> None:
        """Open the line. Raises OSError or termios.error."""
        line = _SerialLine(self._loop, self, device, baud, 8, parity, stop, 0)
        try:
            self._loop.call_soon(line.setup)
            await self._ready.wait()
        except BaseException:
            line.close()
            raise

    async def exchange(self, request: Request) -> Reply:
        """Send one request and return the verdict on its reply, once the line has been silent behind it."""
        trust = self._trust.setdefault(request.unit, _Trust())
        if not await self._silence():
            return Reply(fault=Fault.FRAMING, text="the line is never silent") if self._transport else GONE
        reply = GONE
        try:
            reply = await self._ask(request, trust)
        finally:  # a cancelled exchange leaves a reply behind, like one that failed
            clean = reply.fault in (None, Fault.EXCEPTION)
            trust.clean = trust.clean + 1 if clean else 0
            if not clean:
                self._distrust()
        return reply

    def close(self) -> None:
        """Close the line."""
        if self._transport is not None:
            self._transport.close()
            self._end(GONE)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by the event loop. What the line held before is not ours: it must fall silent first."""
        self._transport = cast(SerialTransport, transport)
        self._distrust()
        self._ready.set()

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by the transport when the device has gone."""
        if self._transport is not None:
            self._end(Reply(fault=Fault.LOST, text=f"serial line lost ({exc})"))
            self._lost(exc)

    def data_received(self, data: bytes) -> None:
        """Called by the transport."""
        if self._request is None:
            self._tally["stray bytes on the line"] += len(data)
            self._strayed = True
            self._distrust()
            return
        if not self._line:
            self._first_byte_at = self._loop.time()
        self._line += data
        reply = check_rtu(self._request, self._line)
        if reply is not None:
            self._settle(reply)

    async def _ask(self, request: Request, trust: _Trust) -> Reply:
        if self._transport is None:
            return GONE
        self._line, self._strayed = b"", False
        self._request, self._answer = request, self._loop.create_future()
        sent, timer = self._loop.time(), self._loop.call_later(self._timeout, self._expire)
        self._transport.write(rtu_frame(request))
        try:
            reply = await self._answer
        finally:
            timer.cancel()
            self._request = None
        if reply.fault not in (None, Fault.EXCEPTION):
            return reply
        return await self._confirmed(reply, sent, trust)

    async def _confirmed(self, reply: Reply, sent: float, trust: _Trust) -> Reply:
        """The reply itself if the line stays silent behind it."""
        behind = trust.silence(self._gap, self._quiet)
        trust.learn(self._first_byte_at - sent)
        until = max(self._loop.time() + behind, sent + MARGIN * trust.first_byte)
        await asyncio.sleep(until - self._loop.time())
        if self._strayed or self._waiting():
            return Reply(fault=Fault.SURPLUS, text="more bytes came behind the reply: it may belong to another request")
        return reply

    async def _silence(self) -> bool:
        """Wait until the line has been silent for as long as it must be; False when it never is or is gone."""
        give_up = self._loop.time() + 4 * (self._timeout + self._quiet)
        while self._transport is not None:
            if self._waiting():
                self._distrust()
            remaining = self._silent_from - self._loop.time()
            if remaining <= 0:
                return True
            if self._loop.time() > give_up:
                return False
            await asyncio.sleep(remaining)
        return False

    def _waiting(self) -> bool:
        """Whether bytes lie in the driver that the event loop has not delivered yet."""
        try:
            return self._transport is not None and self._transport.sync_serial.in_waiting > 0
        except OSError:
            return False  # the device has gone; the transport reports it

    def _distrust(self) -> None:
        self._silent_from = self._loop.time() + self._quiet

    def _expire(self) -> None:
        self._settle(Reply(fault=Fault.SILENCE, text=f"no reply within {self._timeout:g} s"))

    def _settle(self, reply: Reply) -> None:
        if self._request is not None and not self._answer.done():
            self._answer.set_result(reply)
            self._request = None

    def _end(self, reply: Reply) -> None:
        self._transport = None
        self._settle(reply)
