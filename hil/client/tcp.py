"""Requests on a Modbus TCP or TLS stream, told apart by transaction ids.

The stream is never cleared, so it stays in step: a late or repeated reply is a whole frame with an old transaction id
and is dropped for that. Whenever the step itself is in doubt the connection is closed, which ends every doubt:

- the stream cannot be followed: a header that is not Modbus;
- a reply stopped half way, and what comes next would be taken for its end;
- bytes lie behind a reply that are no whole frame: its end may belong to another one;
- the end of a reply is itself a whole reply to an earlier request: its own end is missing.

Where a reply ends is said by its length field alone. When its last bytes are lost, the first bytes of whatever comes
next stand in for them, and the rest may come at any later time: no silence, however long, proves that it will not. What
proves it is the answer to a request that was sent afterwards, in its place in the stream: a new transaction id directly
behind the reply. So a reply is believed only behind such a proof, for which one item is read again, unless

- twenty replies in a row were clean: nothing repeated, late, foreign, broken, or cut into pieces; and
- this one came in one piece; and
- its last bytes are not how the reply to a request of late would begin. A few bytes are so by chance, more are refused.

What remains is a reply whose last bytes are replaced by exactly as many others, for there is no checksum, and one on a
connection without a blemish that lost them to a frame which answers no request of ours and is cut into pieces exactly
there. A heartbeat register as the last point of a read shows even that.
"""

from __future__ import annotations

import asyncio
import math
import ssl
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Self, cast

from hil.client.transport import LinkSide, LiveAddress, WireOpening, timeout_of
from hil.client.wire import GONE, Lost, Wire
from hil.modbus.addresses import AddressParts, host_and_port
from hil.modbus.checks import check_tcp, ends_in_frame, ends_like_frame
from hil.modbus.framing import MBAP, Frame, split_frames
from hil.modbus.messages import Reply, ReplyFault, Request

RECENT = 32
"""Transaction ids that are remembered."""
CLEAN_REPLIES = 20
PROOFS = 2
"""How often the proof of one reply is asked for: it may be lost as any other reply."""
CHANCE = 4
"""So many bytes may look like the beginning of another reply by chance: a transaction id and a zero or two."""


@dataclass(frozen=True)
class TcpAddress(LiveAddress):
    """A Modbus TCP server."""

    scheme: ClassVar[str] = "tcp"
    form: ClassVar[str] = "tcp://HOST:PORT"

    host: str
    port: int = 502

    @classmethod
    def of(cls, parts: AddressParts) -> Self:
        """Read an address; port 502 when none is given."""
        parts.options.only("timeout")
        host, port = host_and_port(parts, cls.form, 502)
        return cls(parts.text, host, port, timeout=timeout_of(parts))

    def opening(self) -> WireOpening:
        """Whatever is wrong may heal."""

        async def opened(side: LinkSide) -> Wire:
            return await open_stream(self.host, self.port, self.timeout, side)

        return opened


def reply_head(transaction: int, request: Request) -> bytes:
    """The first bytes of the reply to a request, up to its unit."""
    return Frame(transaction, request.unit, bytes(request.reply_length)).tcp()[:MBAP]


async def open_stream(
    host: str, port: int, timeout: float, side: LinkSide, context: ssl.SSLContext | None = None, name: str | None = None
) -> TcpWire:
    """Open a stream; under TLS where there is a context, to a server of that name. Raises OSError."""
    _, wire = await asyncio.get_running_loop().create_connection(
        lambda: TcpWire(timeout, *side), host, port, ssl=context, server_hostname=name
    )
    return wire


class TcpWire(asyncio.Protocol):
    """Requests on a TCP or TLS stream.

    timeout : s to wait for a reply; transactions : the ids to use; tally : counts what was dropped; lost : see `Lost`.
    """

    def __init__(self, timeout: float, transactions: Iterator[int], tally: Counter[str], lost: Lost) -> None:
        self._timeout, self._transactions, self._tally, self._lost = timeout, transactions, tally, lost
        self._loop = asyncio.get_running_loop()
        self._transport: asyncio.Transport | None = None
        self._stream, self._transaction = b"", 0
        self._recent: deque[int] = deque(maxlen=RECENT)
        self._heads: deque[bytes] = deque(maxlen=RECENT)  # how the replies to these begin
        self._request: Request | None = None
        self._answer: asyncio.Future[Reply]
        self._deadline, self._timer = 0.0, cast("asyncio.TimerHandle | None", None)
        self._clean = 0  # replies since anything on the stream was odd; nothing is trusted at first
        self._doubtful = False  # whether the reply under way needs a proof of its own

    async def exchange(self, request: Request) -> Reply:
        """Send one request and return the verdict on its reply, once it is certain where the reply ends."""
        reply = await self._ask(request)
        if reply.fault is not None or request.writes:  # the echo of a write is compared with it, byte by byte
            return reply
        if self._doubtful or self._clean < CLEAN_REPLIES:
            reply = await self._proven(reply, request)
        self._clean += reply.fault is None
        return reply

    async def _proven(self, reply: Reply, request: Request) -> Reply:
        """The reply itself when the answer to one more request follows it in the stream."""
        proof = Request(request.unit, request.function, request.address, 1)
        for _ in range(PROOFS):
            answer = await self._ask(proof)
            if answer.fault in (ReplyFault.LOST, ReplyFault.FRAMING):
                return answer
            if answer.fault is not ReplyFault.SILENCE:  # whatever it says, its id stands where it must
                return reply
        return Reply(fault=ReplyFault.SILENCE, text="no answer behind the reply shows where the reply ends")

    async def _ask(self, request: Request) -> Reply:
        if self._transport is None:
            return GONE
        self._transaction = next(self._transactions)
        self._recent.append(self._transaction)
        self._heads.append(reply_head(self._transaction, request))
        self._request, self._answer, self._doubtful = request, self._loop.create_future(), bool(self._stream)
        self._deadline = self._loop.time() + self._timeout
        if self._timer is None:
            self._timer = self._loop.call_at(self._deadline, self._on_time)
        self._transport.write(Frame(self._transaction, request.unit, request.pdu).tcp())
        try:
            return await self._answer
        finally:
            self._request = None

    def listens(self, unit: int) -> bool:
        """Never: a late reply has an id of its own."""
        return False

    def close(self) -> None:
        """Close the connection."""
        self._end(GONE)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by the event loop."""
        self._transport = cast(asyncio.Transport, transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by the event loop."""
        if self._transport is not None:
            self._end(Reply(fault=ReplyFault.LOST, text=f"connection lost ({exc or 'closed by the peer'})"))
            self._lost(exc)

    def data_received(self, data: bytes) -> None:
        """Called by the event loop."""
        whole = not self._stream
        frames, self._stream, broken = split_frames(self._stream + data)
        if not (whole and len(frames) == 1 and self._request):
            self._doubtful, self._clean = True, 0  # in pieces, or with something else
        if broken:
            self._doubt(f"the stream is not Modbus any more: {broken}")
        for frame in frames:
            self._check(frame)

    def _check(self, frame: Frame) -> None:
        reply = check_tcp(self._request, self._transaction, frame) if self._request else None
        if reply is None or reply.fault is ReplyFault.TRANSACTION:
            self._tally["dropped frame: late, repeated or unasked"] += 1
            self._doubtful, self._clean = True, 0
        elif self._stream:
            self._doubt("bytes behind the reply")
        elif ends_in_frame(frame.pdu, self._recent):
            self._doubt("an earlier reply inside the reply")
        else:
            alike = ends_like_frame(frame.pdu, self._heads)
            self._doubtful = self._doubtful or alike > 0
            if alike > CHANCE:
                reply = Reply(fault=ReplyFault.LENGTH, text="the end of the reply is how another one begins")
            self._settle(reply)

    def _on_time(self) -> None:
        """One timer for many requests: it moves on to the deadline of the request that waits now."""
        self._timer = None
        if self._request is None:
            return
        if self._loop.time() < self._deadline:
            self._timer = self._loop.call_at(self._deadline, self._on_time)
            return
        if self._stream:
            self._doubt(f"the reply stopped half way for {self._timeout:g} s")
        else:
            self._clean = 0
            self._settle(Reply(fault=ReplyFault.SILENCE, text=f"no reply within {self._timeout:g} s"))

    def _doubt(self, text: str) -> None:
        if self._transport is not None:
            self._tally[ReplyFault.FRAMING] += self._request is None  # else the verdict is counted
            self._end(Reply(fault=ReplyFault.FRAMING, text=text))
            self._lost(ConnectionError(text))

    def _settle(self, reply: Reply) -> None:
        if self._request is not None and not self._answer.done():
            moment = self._loop.time() if reply.fault is None else math.nan
            self._answer.set_result(reply._replace(time=moment))
            self._request = None

    def _end(self, reply: Reply) -> None:
        transport, self._transport = self._transport, None
        if transport is not None:
            transport.abort()
        if self._timer is not None:
            self._timer.cancel()
        self._settle(reply)
