"""How a request and its reply lie on the line: the MBAP header of Modbus TCP and TLS, and the frame of Modbus RTU.

Pure functions, like `hil.modbus.messages`: whatever bytes arrive they return, and never raise. A TCP stream is kept in
step by its length fields alone; a header that cannot be Modbus means that the step is lost for good, and only a new
connection finds it again. An RTU line has no lengths and no ids: the only reply that can be told from a shifted one is
a frame that stands alone.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from typing import NamedTuple

from hil.modbus.messages import Fault, Reply, Request, check_pdu, crc16

LONGEST_PDU = 253
_HEADER = struct.Struct(">HHHB")
_STRIDE = 40503  # odd, so that it visits all ids; near 65536 / 1.618, so that neighbours lie far apart


class Frame(NamedTuple):
    """One message of a TCP stream."""

    transaction: int
    unit: int
    pdu: bytes


def transactions() -> Iterator[int]:
    """The ids of requests, without end: never 0, which servers send when they do not know it, and no neighbours.

    A server that answers with an id off by one or by one bit must not hit the id of the request that follows. Every
    id comes once in 65535 requests.

    >>> ids = transactions()
    >>> [next(ids) for _ in range(4)]
    [40503, 15470, 55973, 30940]
    """
    transaction = 0
    while True:
        transaction = (transaction + _STRIDE) & 0xFFFF
        if transaction:
            yield transaction


def tcp_frame(request: Request, transaction: int) -> bytes:
    """The bytes of a request on TCP or TLS."""
    pdu = request.pdu
    return _HEADER.pack(transaction, 0, 1 + len(pdu), request.unit) + pdu


def split_frames(stream: bytes) -> tuple[list[Frame], bytes, str | None]:
    """The whole frames in a stream, the bytes left over, and why the stream cannot be followed any more, or None.

    >>> split_frames(bytes.fromhex("000700000003 01 0402 0008"))
    ([Frame(transaction=7, unit=1, pdu=b'\\x04\\x02')], b'\\x00\\x08', None)
    """
    frames, start = list[Frame](), 0
    while len(stream) - start >= 6:
        transaction, protocol, length = struct.unpack_from(">HHH", stream, start)
        if protocol != 0:
            return frames, stream[start:], f"protocol id {protocol} instead of 0"
        if not 2 <= length <= LONGEST_PDU + 1:
            return frames, stream[start:], f"a frame of {length} bytes"
        end = start + 6 + length
        if len(stream) < end:
            break
        frames.append(Frame(transaction, stream[start + 6], stream[start + 7 : end]))
        start = end
    return frames, stream[start:], None


def ends_in_frame(pdu: bytes, transactions: Collection[int]) -> bool:
    """Whether the end of a reply is a whole message with one of these transaction ids.

    That happens when a reply stopped half way and an earlier one, late or repeated, fills just what is missing.

    >>> ends_in_frame(bytes.fromhex("0308 0001 9e37 0000 0003 018302"), [0x9E37])
    True
    """
    place = pdu.find(b"\0\0\0", 4)
    while place >= 0:
        inner = int.from_bytes(pdu[place - 2 : place], "big")
        if pdu[place + 3 : place + 4] == bytes([len(pdu) - place - 4 & 0xFF]) and inner in transactions:
            return True
        place = pdu.find(b"\0\0\0", place + 1)
    return False


def check_tcp(request: Request, transaction: int, frame: Frame) -> Reply:
    """The verdict on a frame that arrived while a request waits."""
    if frame.transaction != transaction:
        text = f"a frame with transaction id {frame.transaction}, waiting for {transaction}"
        return Reply(fault=Fault.TRANSACTION, text=text)
    if frame.unit != request.unit:
        return Reply(fault=Fault.UNIT, text=f"unit {frame.unit} answered instead of {request.unit}")
    return check_pdu(request, frame.pdu)


def rtu_frame(request: Request) -> bytes:
    """The bytes of a request on a serial line."""
    body = bytes([request.unit]) + request.pdu
    return body + crc16(body).to_bytes(2, "little")


def check_rtu(request: Request, line: bytes) -> Reply | None:
    """The verdict on all bytes that came since the request; None while they may still become the reply.

    The frame must be alone. Whether it stays alone is for the caller to watch: more bytes make it `Fault.SURPLUS`.

    >>> check_rtu(Request(unit=1, function=4, address=9, count=1), bytes.fromhex("0104020008b8f6")).words
    (8,)
    """
    known = line[:3]
    if known[:1] not in (b"", bytes([request.unit])):
        return Reply(fault=Fault.UNIT, text=f"unit {known[0]} answered instead of {request.unit}")
    if known[1:2] not in (b"", bytes([request.function]), bytes([request.function | 0x80])):
        return Reply(fault=Fault.FUNCTION, text=f"the reply is to function {known[1]:02x}, not {request.function:02x}")
    refused = known[1:2] == bytes([request.function | 0x80])
    if not refused and not request.writes and known[2:] not in (b"", bytes([request.data_bytes])):
        return Reply(fault=Fault.LENGTH, text=f"the reply declares {known[2]} bytes, asked for {request.data_bytes}")
    length = 5 if refused else request.reply_length + 3
    if len(line) < length:
        return None
    if len(line) > length:
        return Reply(fault=Fault.SURPLUS, text=f"{len(line) - length} bytes behind the reply")
    if crc16(line[:-2]) != int.from_bytes(line[-2:], "little"):
        return Reply(fault=Fault.CHECKSUM, text="the checksum of the reply is wrong")
    return check_pdu(request, line[1:-2])
