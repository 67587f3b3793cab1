"""Modbus frames as an injector sees them: bytes of a stream cut into replies, a reply taken apart and put together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from hil.modbus.messages import crc16

Framing = Literal["tcp", "rtu"]

MBAP = 7
"""Bytes before the function code on TCP: transaction, protocol, length, unit."""

_FIXED = {5: 8, 6: 8, 15: 8, 16: 8, 22: 10}
"""Length of RTU replies without a byte count."""


def crc(data: bytes) -> bytes:
    """The check of an RTU frame, low byte first as it goes out.

    >>> crc(bytes.fromhex("010300000001")).hex()
    '840a'
    """
    return crc16(data).to_bytes(2, "little")


@dataclass(frozen=True)
class Reply:
    """A reply without its framing. transaction : TCP only; pdu : function code and data."""

    transaction: int
    unit: int
    pdu: bytes

    @classmethod
    def parse(cls, framing: Framing, frame: bytes) -> Reply:
        """The reply in a whole frame, as `FrameCutter` delivers it."""
        if framing == "tcp":
            return cls(int.from_bytes(frame[:2], "big"), frame[6], frame[MBAP:])
        return cls(0, frame[0], frame[1:-2])

    def frame(self, framing: Framing) -> bytes:
        """The bytes on the wire, with a length or a check that is right."""
        body = bytes([self.unit]) + self.pdu
        if framing == "rtu":
            return body + crc(body)
        return self.transaction.to_bytes(2, "big") + b"\0\0" + len(body).to_bytes(2, "big") + body


class FrameCutter:
    """Cuts the bytes that a server sends into its replies. What is no frame is passed on as one piece."""

    def __init__(self, framing: Framing) -> None:
        self._size = _tcp_size if framing == "tcp" else _rtu_size
        self._pending = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """The replies that are complete now."""
        self._pending += data
        frames = []
        while self._pending:
            size = self._size(self._pending)
            if size is None or size > len(self._pending):
                break
            frames.append(bytes(self._pending[:size]))
            del self._pending[:size]
        return frames


def _tcp_size(data: bytearray) -> int | None:
    return None if len(data) < 6 else max(6 + int.from_bytes(data[4:6], "big"), MBAP + 1)


def _rtu_size(data: bytearray) -> int | None:
    if len(data) < 3:
        return None
    if data[1] & 0x80:
        return 5
    return _FIXED.get(data[1], 5 + data[2])
