"""A peer that shares no code with the link: its frames are packed here, and every value is a function of the request.

What it sends is a stream of bytes. Faults change the stream, and then the stream is cut into pieces with pauses between
them: neither may decide what a value is.
"""

from __future__ import annotations

import asyncio
import struct
from collections import deque
from collections.abc import Callable, Sequence
from itertools import pairwise
from random import Random
from typing import NamedTuple

FAULTS = ("lose", "cut off", "repeat", "repeat the one before", "foreign frame", "noise", "delay")

MOST_LOST = 36
"""Bytes that three faults may take off the end of a reply. Noise and foreign frames are longer: exactly as many other
bytes in the place of those that were lost are what nobody could tell on TCP, which has no checksum.
"""


class Piece(NamedTuple):
    """Bytes of the stream, `pause` seconds after the piece before them."""

    pause: float
    data: bytes


class Verdicts(NamedTuple):
    """What the link made of a peer's replies. replies : that the peer gave, the link's own proofs included; harmed : of
    them; good : values that were believed; wrong : of them; untold : wrong ones that nobody could tell.
    """

    replies: int
    harmed: int
    good: int
    wrong: int
    untold: int = 0


def words_of(number: int, count: int) -> tuple[int, ...]:
    """The registers that request number `number` is answered with."""
    return tuple((number * 40503 + k * 2654435761 >> 7 ^ number) & 0xFFFF for k in range(count))


def tcp_frame(transaction: int, unit: int, function: int, words: Sequence[int]) -> bytes:
    data = struct.pack(f">{len(words)}H", *words)
    return struct.pack(">HHHBBB", transaction, 0, 3 + len(data), unit, function, len(data)) + data


def rtu_frame(unit: int, function: int, words: Sequence[int]) -> bytes:
    body = struct.pack(f">BBB{len(words)}H", unit, function, 2 * len(words), *words)
    return body + struct.pack("<H", checksum(body))


def checksum(data: bytes) -> int:
    """CRC-16 of the serial line specification (appendix B), bit by bit."""
    register = 0xFFFF
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ 0xA001 * (register & 1)
    return register


class StreamPeer(asyncio.Transport):
    """A transport in memory whose other end answers reads of registers.

    serial : RTU instead of TCP; stream : (reply, the reply before, request number) -> the pieces that are sent of it.
    `number_of` has the number of the last request for an address and a count.
    """

    in_waiting = 0

    def __init__(
        self, protocol: asyncio.Protocol, serial: bool, stream: Callable[[bytes, bytes, int], Sequence[Piece]]
    ) -> None:
        super().__init__()
        self.sync_serial = self
        self.number_of: dict[tuple[int, int], int] = {}
        self.n_requests, self.gone = 0, False
        self._protocol, self._serial, self._stream = protocol, serial, stream
        self._before, self._free_at = b"", 0.0
        self._true, self._arrived, self._in_a_row, self._clean = b"", list[bytes](), 0, 0
        self._on_the_way = deque[bytes]()  # timers that are due at once keep no order

    def write(self, data: bytes) -> None:
        asyncio.get_running_loop().call_later(0.0007, self._answer, data)

    def abort(self) -> None:
        self.gone = True

    close = abort

    def _answer(self, data: bytes) -> None:
        self.n_requests += 1
        transaction, pdu = (0, data[:6]) if self._serial else (int.from_bytes(data[:2], "big"), data[6:12])
        unit, function, address, count = struct.unpack(">BBHH", pdu)
        self.number_of[address, count] = self.n_requests
        words = words_of(self.n_requests, count)
        reply = rtu_frame(unit, function, words) if self._serial else tcp_frame(transaction, unit, function, words)
        pieces = self._stream(reply, self._before, self.n_requests)
        self._true, self._arrived, self._clean = reply, [], self._in_a_row
        self._in_a_row = self._in_a_row + 1 if list(pieces) == [Piece(0.0, reply)] else 0
        for piece in pieces:
            self._send(piece)
        self._before = reply

    def untold(self, trusted: int) -> bool:
        """Whether nobody could tell that the last reply is wrong: on TCP, which has no checksum, it came as one whole
        frame with other bytes at its end, and so many replies before it were without a blemish.
        """
        whole = len(self._arrived) == 1 and len(self._arrived[0]) == len(self._true)
        return not self._serial and self._clean >= trusted and whole and self._arrived[0][:9] == self._true[:9]

    def _send(self, piece: Piece) -> None:
        loop = asyncio.get_running_loop()
        self._free_at = max(self._free_at, loop.time()) + piece.pause
        self._on_the_way.append(piece.data)
        loop.call_at(self._free_at, self._deliver)

    def _deliver(self) -> None:
        data = self._on_the_way.popleft()
        if not self.gone and data:
            self._arrived.append(data)
            self._protocol.data_received(data)


class Sending(asyncio.Protocol):
    """What the peer says goes out on a connection."""

    def __init__(self, transport: asyncio.Transport) -> None:
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        if not self._transport.is_closing():
            self._transport.write(data)


class Faults:
    """Up to three faults in a share of the replies, and the stream in pieces.

    timeout, late : of the link [s]; foreign : makes a frame that answers nobody. Pauses reach from none to longer
    than the timeout.
    """

    def __init__(
        self, random: Random, share: float, timeout: float, late: float, foreign: Callable[[Random], bytes]
    ) -> None:
        self._random, self._share, self._timeout, self._late, self._foreign = random, share, timeout, late, foreign
        self.harmed = 0

    def __call__(self, reply: bytes, before: bytes, number: int) -> list[Piece]:
        if self._random.random() >= self._share:
            return [Piece(0.0, reply)]
        self.harmed += 1
        stream, delay = reply, 0.0
        for fault in self._random.choices(FAULTS, k=self._random.randint(1, 3)):
            if fault == "delay":
                delay = self._random.uniform(0.0, self._timeout + 0.9 * self._late)
            else:
                stream = self._harmed(fault, stream, reply, before)
        return [Piece(delay, b""), *self._cut(stream)]

    def _harmed(self, fault: str, stream: bytes, reply: bytes, before: bytes) -> bytes:
        match fault:
            case "lose":
                return b""
            case "cut off":
                return stream[: -self._random.randint(1, MOST_LOST // 3)]
            case "repeat":
                return stream + reply
            case "repeat the one before":
                return stream + before if self._random.random() < 0.5 else before + stream
            case "foreign frame":
                frame = self._foreign(self._random)
                return stream + frame if self._random.random() < 0.5 else frame + stream
            case _:
                return stream + self._random.randbytes(self._random.randint(MOST_LOST + 1, 60))

    def _cut(self, stream: bytes) -> list[Piece]:
        """At a few places or at every byte, with pauses of every length."""
        places = sorted({0, len(stream), *(self._random.randint(0, len(stream)) for _ in range(3))})
        if self._random.random() < 0.2:
            places = list(range(len(stream) + 1))
        longest = self._random.choice((0.0, 0.0, 0.001, 0.3 * self._timeout, 1.5 * self._timeout))
        longest /= len(places) if len(places) > 9 else 1
        return [Piece(self._random.uniform(0.0, longest), stream[a:b]) for a, b in pairwise(places)]
