"""Requests on a Modbus RTU line, told apart by silence.

RTU has no transaction ids: a late or repeated reply looks like the answer to the next request, and silence is the only
proof that there is none. Let `late` be longer than any reply is late, counted from the timeout, and `quiet` longer than
any repetition lags behind its original. Then:

1. A request is sent only into silence. After a timeout or any other fault the line is left alone until nothing has come
   for `quiet`; bytes that came while nobody waited are such a fault, they are never skipped. The unit itself is not
   asked before its reply can be late no longer; its neighbours are, for a reply says whose it is. What somebody asked
   before us is waited for when the line is opened. A unit whose replies are seen to come late is given more time.
2. A reply counts only if the line stays silent behind it. If a stray frame took its place, the true reply follows
   within the device's usual time to answer, and both are dropped. So the silence is awaited until the longest usual
   time to the first byte and a quarter more has passed since the request, and at least for the 3.5 characters of the
   standard: no loss of time where a reply takes longer than that anyway.
3. On a line that is new or has seen anything stray or broken, and of a unit that has been silent, the silence behind a
   reply lasts longer, until twenty replies in a row were clean: ten times the unit's usual time to answer, at least
   50 ms and at most `quiet`. No stray frame that is due by then can reach the request after its own.

What remains is a repetition that comes after twenty clean replies, lags by more than the usual time to answer, and
meets a request whose own reply is lost, or stands in its place. A heartbeat register among the values shows even that,
and so do reads of different lengths.
"""

from __future__ import annotations

import asyncio
import math
import os
from collections import Counter
from dataclasses import dataclass
from typing import ClassVar, Self, cast

from pymodbus.transport.serialtransport import SerialTransport

from hil.client.transport import LinkSide, LiveAddress, WireOpening, timeout_of
from hil.client.wire import GONE, Lost, Wire
from hil.modbus.addresses import TIMEOUT_S, AddressParts, SerialLine, serial_line
from hil.modbus.checks import check_rtu
from hil.modbus.framing import Frame
from hil.modbus.messages import Reply, ReplyFault, Request
from hil.modbus.serial_line import check_serial_line, usable

CLEAN_REPLIES = 20
MARGIN = 1.25
SHORTEST_WATCH_S = 0.05
ANSWERS_WITHIN_S = 5.0
"""Default options are safe for devices that answer within so long."""


@dataclass(frozen=True)
class RtuAddress(LiveAddress):
    """Devices on a serial line.

    quiet : s of silence after a fault, longer than a repetition lags; late : s behind the timeout in which a reply may
    still come.
    """

    scheme: ClassVar[str] = "rtu"
    form: ClassVar[str] = "rtu:DEVICE?baud=..&parity=.."
    reopened: ClassVar[bool] = False  # a line that is open is there, whoever is silent on it

    line: SerialLine
    quiet: float = TIMEOUT_S
    late: float = ANSWERS_WITHIN_S - TIMEOUT_S

    @classmethod
    def of(cls, parts: AddressParts) -> Self:
        """Read an address. When they are not given, `quiet` is the timeout, and `late` reaches to 5 s, or is `quiet`
        where that is given: who knows the line says how late its replies are.
        """
        parts.options.only("baud", "parity", "stop", "timeout", "quiet", "late")
        line, timeout = serial_line(parts, cls.form), timeout_of(parts)
        quiet = parts.options.number("quiet", timeout, 1e-3, 600.0)
        unknown = quiet if parts.options.word("quiet") else max(quiet, ANSWERS_WITHIN_S - timeout)
        return cls(parts.text, line, quiet, parts.options.number("late", unknown, 1e-3, 600.0), timeout=timeout)

    def opening(self) -> WireOpening:
        """Raises BadInput for a device that is missing or busy."""
        check_serial_line(self.text, self.line)

        async def opened(side: LinkSide) -> Wire:
            wire = RtuWire(self.timeout, self.quiet, self.line.gap, side.tally, side.lost, self.late)
            await wire.open(usable(self.line))
            return wire

        return opened


@dataclass
class _Unit:
    """What is known of one unit: its longest usual time to a first byte [s], its replies since it was silent, how long
    it is waited for [s], its last request and when that was sent, and until when its reply to that may come.
    """

    first_byte: float = 0.0
    clean: int = CLEAN_REPLIES
    patience: float = 0.0
    request: Request | None = None
    sent: float = 0.0
    owes_until: float = 0.0

    def learn(self, first_byte: float) -> None:
        self.first_byte = max(first_byte, 0.95 * self.first_byte)


class _Transport(SerialTransport):
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
    the standard; tally, lost : as in `TcpWire`; late : s behind the timeout in which a reply may come, `quiet` when it
    is not given.
    """

    def __init__(
        self, timeout: float, quiet: float, gap: float, tally: Counter[str], lost: Lost, late: float | None = None
    ) -> None:
        self._timeout, self._quiet, self._gap, self._tally, self._lost = timeout, quiet, gap, tally, lost
        self._late = quiet if late is None else late
        self._loop = asyncio.get_running_loop()
        self._transport: SerialTransport | None = None
        self._line, self._request = b"", cast("Request | None", None)
        self._answer: asyncio.Future[Reply]
        self._silent_from = self._first_byte_at = 0.0  # the line may speak until then; when a reply began
        self._units: dict[int, _Unit] = {}
        self._stray = b""  # what came unasked since the line was silent: perhaps the late reply of a unit
        self._clean = 0  # replies since anything on the line was stray or broken; nothing is trusted at first
        self._ready = asyncio.Event()
        self._strayed = False  # since the request under way was sent

    async def open(self, serial: SerialLine) -> None:
        """Open the line. Raises OSError or TerminalError."""
        line = _Transport(self._loop, self, serial.device, serial.baud, 8, serial.parity, serial.stop, 0)
        try:
            self._loop.call_soon(line.setup)
            await self._ready.wait()
        except BaseException:
            line.close()
            raise

    async def exchange(self, request: Request) -> Reply:
        """Send one request and return the verdict on its reply, once the line has been silent behind it."""
        unit = self._units.setdefault(request.unit, _Unit(patience=self._timeout))
        await asyncio.sleep(unit.owes_until - self._loop.time())
        if not await self._silence():
            return Reply(fault=ReplyFault.FRAMING, text="the line is never silent") if self._transport else GONE
        reply = GONE
        try:
            reply = await self._ask(request, unit)
        finally:  # a cancelled exchange leaves a reply behind, like one that failed
            self._draw_conclusions(reply.fault, unit)
        return reply

    def listens(self, unit: int) -> bool:
        """Whether a unit's late reply is waited for, and for longer than the line needs to fall silent."""
        known = self._units.get(unit)
        return known is not None and known.owes_until > max(self._loop.time(), self._silent_from) + self._quiet

    def close(self) -> None:
        """Close the line."""
        if self._transport is not None:
            self._transport.close()
            self._end(GONE)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by the event loop. What the line held before is not ours: it must fall silent first."""
        self._transport = cast(SerialTransport, transport)
        self._silent_from = self._loop.time() + self._late
        self._ready.set()

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by the transport when the device has gone."""
        if self._transport is not None:
            self._end(Reply(fault=ReplyFault.LOST, text=f"serial line lost ({exc})"))
            self._lost(exc)

    def data_received(self, data: bytes) -> None:
        """Called by the transport."""
        if self._request is None:
            self._tally["stray bytes on the line"] += len(data)
            self._strayed, self._clean = True, 0
            self._note_late(data)
            self._hush()
            return
        if not self._line:
            self._first_byte_at = self._loop.time()
        self._line += data
        reply = check_rtu(self._request, self._line)
        if reply is not None:
            self._settle(reply)

    async def _ask(self, request: Request, unit: _Unit) -> Reply:
        if self._transport is None:
            return GONE
        self._line, self._strayed = b"", False
        self._request, self._answer = request, self._loop.create_future()
        unit.request, unit.sent, self._stray = request, self._loop.time(), b""
        timer = self._loop.call_later(unit.patience, self._expire, unit.patience)
        self._transport.write(Frame(0, request.unit, request.pdu).rtu())
        try:
            reply = await self._answer
        finally:
            timer.cancel()
            self._request = None
        if reply.fault not in (None, ReplyFault.EXCEPTION):
            return reply
        return await self._confirmed(reply, unit)

    async def _confirmed(self, reply: Reply, unit: _Unit) -> Reply:
        """The reply itself if the line stays silent behind it."""
        behind = self._silence_behind(unit)
        unit.learn(self._first_byte_at - unit.sent)
        until = max(self._loop.time() + behind, unit.sent + MARGIN * unit.first_byte)
        await asyncio.sleep(until - self._loop.time())
        if self._strayed or self._waiting():
            return Reply(
                fault=ReplyFault.SURPLUS, text="more bytes came behind the reply: it may belong to another request"
            )
        return reply

    def _silence_behind(self, unit: _Unit) -> float:
        """How long the line must be silent behind a reply [s]."""
        if unit.first_byte == 0.0:
            return self._quiet  # what was asked before us came while the line was listened to
        if min(self._clean, unit.clean) >= CLEAN_REPLIES:
            return self._gap
        return max(self._gap, min(self._quiet, max(10 * unit.first_byte, SHORTEST_WATCH_S)))

    def _draw_conclusions(self, fault: ReplyFault | None, unit: _Unit) -> None:
        if fault in (None, ReplyFault.EXCEPTION):
            self._clean, unit.clean = self._clean + 1, unit.clean + 1
            return
        unit.clean, unit.owes_until = 0, unit.sent + unit.patience + self._late
        self._stray = self._line
        if fault is not ReplyFault.SILENCE:  # a dead unit says nothing about its neighbours
            self._clean = 0
        self._hush()

    def _note_late(self, data: bytes) -> None:
        """Give a unit more time whose reply comes when it is no longer waited for."""
        self._stray += data
        unit = self._units.get(self._stray[0])
        if unit is None or unit.request is None:
            return
        reply = check_rtu(unit.request, self._stray)
        if reply is not None and reply.fault in (None, ReplyFault.EXCEPTION):
            lateness = self._loop.time() - unit.sent
            unit.patience = min(max(unit.patience, MARGIN * lateness), self._timeout + self._late)

    async def _silence(self) -> bool:
        """Wait until the line has been silent for as long as it must be; False when it never is or is gone."""
        give_up = max(self._loop.time(), self._silent_from) + 4 * (self._timeout + self._quiet)
        while self._transport is not None:
            if self._waiting():
                self._hush()
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

    def _hush(self) -> None:
        """Let nothing be sent until the line has been silent for long enough."""
        self._silent_from = self._loop.time() + self._quiet

    def _expire(self, patience: float) -> None:
        if self._line:
            text = f"the reply stopped half way, {len(self._line)} bytes came within {patience:g} s"
            self._settle(Reply(fault=ReplyFault.LENGTH, text=text))
        else:
            self._settle(Reply(fault=ReplyFault.SILENCE, text=f"no reply within {patience:g} s"))

    def _settle(self, reply: Reply) -> None:
        if self._request is not None and not self._answer.done():
            moment = self._loop.time() if reply.fault is None else math.nan
            self._answer.set_result(reply._replace(time=moment))
            self._request = None

    def _end(self, reply: Reply) -> None:
        self._transport = None
        self._settle(reply)
