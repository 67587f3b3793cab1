"""What a reply must be before a value is taken from it: bytes in, verdicts out.

No socket, no clock and no wire library here, so that every rule can be tried with a bytes literal. A reply is accepted
only when everything that the protocol lets us compare is right:

    Modbus TCP, TLS   transaction id (never 0), protocol id, length, unit, function, byte count
    Modbus RTU        unit, function, byte count, CRC, and not one byte before or behind the frame

and a value only when it is finite, in its valid range and not one of its invalid values (`hil.registers.codec.decode`).

A TCP stream is kept in step by its length fields alone; a header that cannot be Modbus means that the step is lost for
good, and only a new connection finds it again. An RTU line has no lengths and no ids: the only reply that can be told
from a shifted one is a frame that stands alone.

Bytes that arrive one by one get the same verdict as bytes that arrive at once. Whatever arrives, these functions
return: they never raise.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator

from hil.modbus.framing import Frame, crc
from hil.modbus.messages import EXCEPTIONS, READ_REGISTERS, Reply, ReplyFault, Request

_STRIDE = 40503  # odd, so that it visits all ids; near 65536 / 1.618, so that neighbours lie far apart


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


def check_tcp(request: Request, transaction: int, frame: Frame) -> Reply:
    """The verdict on a frame that arrived while a request waits."""
    if frame.transaction != transaction:
        text = f"a frame with transaction id {frame.transaction}, waiting for {transaction}"
        return Reply(fault=ReplyFault.TRANSACTION, text=text)
    if frame.unit != request.unit:
        return Reply(fault=ReplyFault.UNIT, text=f"unit {frame.unit} answered instead of {request.unit}")
    return check_pdu(request, frame.pdu)


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


def ends_like_frame(pdu: bytes, heads: Collection[bytes]) -> int:
    """How many bytes of a reply, from some place to its end, are how another message would begin; 0 for none.

    heads : the first bytes, up to the unit, of the messages that are possible.

    >>> heads = [bytes.fromhex("9e37 0000 0007 01")]
    >>> [ends_like_frame(bytes.fromhex(pdu), heads) for pdu in ("0302 009e", "0304 00009e37", "0306 019e37000000")]
    [1, 2, 5]
    >>> ends_like_frame(bytes.fromhex("0308 9e37 0000 0007 0103"), heads)
    8
    >>> ends_like_frame(bytes.fromhex("0304 9e37 0001"), heads)
    0
    """
    places = [place for head in heads if (place := pdu.find(head, 2)) >= 0]
    if places:
        return len(pdu) - min(places)
    longest = len(next(iter(heads), b""))
    return next((n for n in range(longest - 1, 0, -1) if any(pdu.endswith(head[:n]) for head in heads)), 0)


def check_rtu(request: Request, line: bytes) -> Reply | None:
    """The verdict on all bytes that came since the request; None while they may still become the reply.

    The frame must be alone. Whether it stays alone is for the caller to watch: more bytes make it `ReplyFault.SURPLUS`.

    >>> check_rtu(Request(unit=1, function=4, address=9, count=1), bytes.fromhex("0104020008b8f6")).words
    (8,)
    """
    known = line[:3]
    if known[:1] not in (b"", bytes([request.unit])):
        return Reply(fault=ReplyFault.UNIT, text=f"unit {known[0]} answered instead of {request.unit}")
    if known[1:2] not in (b"", bytes([request.function]), bytes([request.function | 0x80])):
        return Reply(
            fault=ReplyFault.FUNCTION, text=f"the reply is to function {known[1]:02x}, not {request.function:02x}"
        )
    refused = known[1:2] == bytes([request.function | 0x80])
    if not refused and not request.writes and known[2:] not in (b"", bytes([request.data_bytes])):
        return Reply(
            fault=ReplyFault.LENGTH, text=f"the reply declares {known[2]} bytes, asked for {request.data_bytes}"
        )
    length = 5 if refused else request.reply_length + 3
    if len(line) < length:
        return None
    if len(line) > length:
        return Reply(fault=ReplyFault.SURPLUS, text=f"{len(line) - length} bytes behind the reply")
    if crc(line[:-2]) != line[-2:]:
        return Reply(fault=ReplyFault.CHECKSUM, text="the checksum of the reply is wrong")
    return check_pdu(request, line[1:-2])


def check_pdu(request: Request, pdu: bytes) -> Reply:
    """The verdict on a reply, from its function code to the end of its data, transport headers taken off.

    >>> check_pdu(Request(unit=1, function=3, address=0, count=2), bytes.fromhex("03040001ffff")).words
    (1, 65535)
    >>> check_pdu(Request(unit=1, function=3, address=0, count=2), bytes.fromhex("03020001")).text
    'the reply has 4 bytes, 6 are right for this request'
    """
    function, right = pdu[:1], bytes([request.function])
    if function == bytes([request.function | 0x80]) and len(pdu) == 2:
        words = EXCEPTIONS.get(pdu[1], "not in the standard")
        return Reply(fault=ReplyFault.EXCEPTION, text=f"exception {pdu[1]}: {words}", exception=pdu[1])
    if pdu == request.pdu and not request.writes:
        return Reply(fault=ReplyFault.ECHO, text="the reply is the request itself: an echo on the line, not the device")
    if function != right:
        return Reply(
            fault=ReplyFault.FUNCTION, text=f"a reply to function {function.hex() or 'none'}, not {right.hex()}"
        )
    if len(pdu) != request.reply_length:
        text = f"the reply has {len(pdu)} bytes, {request.reply_length} are right for this request"
        return Reply(fault=ReplyFault.LENGTH, text=text)
    if request.writes:
        return _check_echo(request, pdu)
    if pdu[1] != request.data_bytes:
        return Reply(fault=ReplyFault.LENGTH, text=f"the reply declares {pdu[1]} bytes, asked for {request.data_bytes}")
    return Reply(_words(request, pdu[2:]))


def _check_echo(request: Request, pdu: bytes) -> Reply:
    if pdu != request.pdu[:5]:
        return Reply(fault=ReplyFault.LENGTH, text=f"the device acknowledged {pdu[1:].hex()}, not what was written")
    return Reply(request.words)


def _words(request: Request, data: bytes) -> tuple[int, ...]:
    if request.function in READ_REGISTERS:
        return struct.unpack(f">{request.count}H", data)
    packed = int.from_bytes(data, "little")
    return tuple(packed >> k & 1 for k in range(request.count))
