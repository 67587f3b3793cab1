"""How messages lie on the line: the MBAP header of Modbus TCP and TLS, the frame of Modbus RTU and its checksum.

Pure functions: whatever bytes arrive they return, and never raise. The client, the server and the fault injector all
cut and build their frames here.

    TCP, TLS   transaction (2 bytes), protocol 0 (2), length of what follows (2), unit (1), message
    RTU        unit (1), message, checksum (2, low byte first)
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

LONGEST_PDU = 253
MBAP = 7
"""Bytes before the function code on TCP: transaction, protocol, length, unit."""

_MBAP = struct.Struct(">HHHB")
_HEADER = struct.Struct(">HHH")
_ECHOES = {5: 8, 6: 8, 15: 8, 16: 8, 22: 10}
"""Length of RTU replies without a byte count."""


class Frame(NamedTuple):
    """One message and whom it is from or for. transaction : TCP only; pdu : function code and data.

    >>> Frame.of_rtu(Frame(0, 1, b"\x04\x02").rtu()) == Frame(0, 1, b"\x04\x02")
    True
    """

    transaction: int
    unit: int
    pdu: bytes

    @classmethod
    def of_tcp(cls, data: bytes) -> Frame:
        """The message in the bytes of a whole frame on TCP."""
        return cls(int.from_bytes(data[:2], "big"), data[MBAP - 1], data[MBAP:])

    @classmethod
    def of_rtu(cls, data: bytes) -> Frame:
        """The message in the bytes of a whole frame on a serial line; its checksum is not looked at."""
        return cls(0, data[0], data[1:-2])

    def tcp(self) -> bytes:
        """The bytes on TCP or TLS."""
        return _MBAP.pack(self.transaction, 0, 1 + len(self.pdu), self.unit) + self.pdu

    def rtu(self) -> bytes:
        """The bytes on a serial line."""
        body = bytes([self.unit]) + self.pdu
        return body + crc(body)


class FrameHeader(NamedTuple):
    """The first six bytes of a frame on TCP. length : of what follows them."""

    transaction: int
    protocol: int
    length: int

    @classmethod
    def at(cls, stream: bytes | bytearray, start: int = 0) -> FrameHeader | None:
        """The header that begins there; None while it is not whole."""
        return cls(*_HEADER.unpack_from(stream, start)) if len(stream) - start >= _HEADER.size else None

    @property
    def size(self) -> int:
        """Bytes of the whole frame."""
        return _HEADER.size + self.length

    @property
    def problem(self) -> str | None:
        """Why it cannot be Modbus: then the stream cannot be followed any more. None when it can."""
        if self.protocol != 0:
            return f"protocol id {self.protocol} instead of 0"
        if not 2 <= self.length <= LONGEST_PDU + 1:
            return f"a frame of {self.length} bytes"
        return None


def split_frames(stream: bytes) -> tuple[list[Frame], bytes, str | None]:
    """The whole frames in a stream, the bytes left over, and why the stream cannot be followed any more, or None.

    >>> split_frames(bytes.fromhex("000700000003 01 0402 0008"))
    ([Frame(transaction=7, unit=1, pdu=b'\\x04\\x02')], b'\\x00\\x08', None)
    """
    frames, start = list[Frame](), 0
    while header := FrameHeader.at(stream, start):
        if header.problem:
            return frames, stream[start:], header.problem
        end = start + header.size
        if len(stream) < end:
            break
        frames.append(Frame(header.transaction, stream[start + 6], stream[start + MBAP : end]))
        start = end
    return frames, stream[start:], None


def rtu_reply_size(data: bytes | bytearray) -> int | None:
    """Bytes of the reply on a serial line that begins so; None while that is not known."""
    if len(data) < 3:
        return None
    if data[1] & 0x80:
        return 5
    return _ECHOES.get(data[1], 5 + data[2])


def crc(data: bytes) -> bytes:
    """The checksum of an RTU frame as it goes out, low byte first.

    >>> crc(bytes.fromhex("010300000001")).hex()
    '840a'
    """
    return crc16(data).to_bytes(2, "little")


def crc16(data: Sequence[int]) -> int:
    """The checksum of Modbus RTU (polynomial A001 reflected, start FFFF), low byte first on the line.

    >>> hex(crc16(bytes.fromhex("010300000002")))
    '0xbc4'
    """
    crc = 0xFFFF
    for byte in data:
        crc = crc >> 8 ^ _CRC[(crc ^ byte) & 0xFF]
    return crc


def _crc_of(byte: int) -> int:
    for _ in range(8):
        byte = byte >> 1 ^ (0xA001 if byte & 1 else 0)
    return byte


_CRC = tuple(_crc_of(byte) for byte in range(256))
