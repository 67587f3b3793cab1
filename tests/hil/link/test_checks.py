"""The rules for replies, as bytes: what is refused, that nothing raises, and that pieces change no verdict."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest

from hil.modbus.checks import check_pdu, check_rtu, check_tcp, ends_in_frame, transactions
from hil.modbus.framing import Frame, crc, crc16, split_frames
from hil.modbus.messages import Reply, ReplyFault, Request

READ = Request(unit=1, function=3, address=0x10, count=2)
BITS = Request(unit=1, function=2, address=0, count=10)
WRITE = Request(unit=1, function=16, address=4, count=2, words=(1, 0xFFFF))
COIL = Request(unit=1, function=15, address=4, count=3, words=(1, 0, 1))


def rtu(body: str) -> bytes:
    data = bytes.fromhex(body)
    return data + crc(data)


def sent_on_tcp(request: Request, transaction: int) -> bytes:
    return Frame(transaction, request.unit, request.pdu).tcp()


def sent_on_a_line(request: Request) -> bytes:
    return Frame(0, request.unit, request.pdu).rtu()


def test_a_request_is_laid_out_as_the_standard_says():
    # Modbus Application Protocol 1.1b3, sections 6.3, 6.11 and 6.12; Modbus over Serial Line 1.02, 6.2.2 for the CRC.
    assert READ.pdu.hex() == "0300100002"
    assert WRITE.pdu.hex() == "100004000204" + "0001ffff"
    assert COIL.pdu.hex() == "0f00040003" + "01" + "05"
    assert sent_on_tcp(READ, 0x1234).hex() == "1234" + "0000" + "0006" + "01" + "0300100002"
    assert sent_on_a_line(Request(unit=2, function=7 - 3, address=0, count=1)).hex() == "020400000001" + "31f9"
    assert crc16(bytes.fromhex("0207")) == 0x1241


@pytest.mark.parametrize(
    ("pdu", "words"),
    [("0304" + "0001ffff", (1, 0xFFFF)), ("0304" + "00000000", (0, 0))],
)
def test_a_right_reply_gives_its_registers(pdu, words):
    assert check_pdu(READ, bytes.fromhex(pdu)) == Reply(words)


def test_bits_are_read_from_the_lowest_on_and_padding_is_left_out():
    assert check_pdu(BITS, bytes.fromhex("0202" + "05ff")).words == (1, 0, 1, 0, 0, 0, 0, 0, 1, 1)


def test_an_acknowledged_write_gives_what_was_written():
    assert check_pdu(WRITE, bytes.fromhex("1000040002")).words == (1, 0xFFFF)
    assert check_pdu(COIL, bytes.fromhex("0f00040003")).words == (1, 0, 1)


@pytest.mark.parametrize(
    ("request_", "pdu", "fault"),
    [
        (READ, "", ReplyFault.FUNCTION),
        (READ, "03", ReplyFault.LENGTH),
        (READ, "0302" + "0001", ReplyFault.LENGTH),  # too few registers
        (READ, "0306" + "000100020003", ReplyFault.LENGTH),  # too many
        (READ, "0304" + "000100", ReplyFault.LENGTH),  # byte count does not fit
        (READ, "0303" + "00010002", ReplyFault.LENGTH),  # byte count odd
        (READ, "0404" + "00010002", ReplyFault.FUNCTION),
        (READ, "8402", ReplyFault.FUNCTION),  # an exception to another function
        (READ, "83", ReplyFault.FUNCTION),
        (READ, "830201", ReplyFault.FUNCTION),
        (READ, "8302", ReplyFault.EXCEPTION),
        (READ, "834d", ReplyFault.EXCEPTION),
        (BITS, "0201" + "05", ReplyFault.LENGTH),
        (WRITE, "1000040001", ReplyFault.LENGTH),  # fewer registers written than asked
        (WRITE, "1000050002", ReplyFault.LENGTH),
    ],
)
def test_a_wrong_reply_is_refused_and_named(request_, pdu, fault):
    reply = check_pdu(request_, bytes.fromhex(pdu))
    assert (reply.fault, reply.words) == (fault, ())
    assert reply.text


@pytest.mark.parametrize(("code", "silent"), [(2, False), (6, False), (10, True), (11, True)])
def test_only_a_gateway_that_found_nobody_makes_a_device_silent(code, silent):
    reply = check_pdu(READ, bytes([0x83, code]))
    assert (reply.exception, reply.device_silent) == (code, silent)


def test_a_frame_counts_only_with_the_transaction_and_the_unit_that_were_asked():
    pdu = bytes.fromhex("030400010002")
    assert check_tcp(READ, 7, Frame(7, 1, pdu)).words == (1, 2)
    assert check_tcp(READ, 7, Frame(0, 1, pdu)).fault is ReplyFault.TRANSACTION  # 0, which other clients take for any
    assert check_tcp(READ, 7, Frame(8, 1, pdu)).fault is ReplyFault.TRANSACTION
    assert check_tcp(READ, 7, Frame(7, 2, pdu)).fault is ReplyFault.UNIT


def test_transaction_ids_are_never_zero_never_neighbours_and_come_once_in_65535():
    ids = transactions()
    first = [next(ids) for _ in range(65535)]
    assert len(set(first)) == 65535
    assert 0 not in first
    assert next(ids) == first[0]
    assert min(abs(a - b) for a, b in pairwise(first)) > 1000


@pytest.mark.parametrize(
    ("stream", "why"),
    [
        ("0001 0001 0003 018302", "protocol id 1 instead of 0"),
        ("0001 0000 0001 01", "a frame of 1 bytes"),
        ("0001 0000 00ff 01", "a frame of 255 bytes"),
    ],
)
def test_a_stream_that_cannot_be_followed_says_why(stream, why):
    assert split_frames(bytes.fromhex(stream))[2] == why


def test_a_reply_that_ends_in_another_whole_reply_is_noticed():
    whole = bytes.fromhex("9e37 0000 0007 01 0304 00080009")
    assert ends_in_frame(bytes.fromhex("0310 0001 00") + whole, [0x9E37])
    assert not ends_in_frame(bytes.fromhex("0310 0001 00") + whole, [0x0001])
    assert not ends_in_frame(bytes.fromhex("0304 0000 0000 0000"), [0x9E37])


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        (rtu("020304" + "00010002"), ReplyFault.UNIT),
        (rtu("010404" + "00010002"), ReplyFault.FUNCTION),
        (rtu("010306" + "000100020003"), ReplyFault.LENGTH),
        (rtu("010304" + "00010002")[:-1] + b"\0", ReplyFault.CHECKSUM),
        (rtu("010304" + "00010002") + b"\0", ReplyFault.SURPLUS),  # not alone: it may not be ours
        (b"\0" + rtu("010304" + "00010002"), ReplyFault.UNIT),
        (rtu("018302"), ReplyFault.EXCEPTION),
        (rtu("018402"), ReplyFault.FUNCTION),
    ],
)
def test_a_wrong_line_is_refused_and_named(line, fault):
    reply = check_rtu(READ, line)
    assert reply is not None
    assert reply.fault is fault


def test_a_line_waits_for_the_rest_of_a_reply():
    line = rtu("010304" + "00010002")
    assert [check_rtu(READ, line[:n]) for n in range(len(line))] == [None] * len(line)
    assert check_rtu(READ, line).words == (1, 2)
    acknowledged = rtu("011000040002")
    assert check_rtu(WRITE, acknowledged[:-1]) is None
    assert check_rtu(WRITE, acknowledged).words == (1, 0xFFFF)


def harmed(random: Random, frame: bytes) -> bytes:
    """A frame with bytes changed, cut, doubled, or put together with noise; sometimes only noise."""
    kind = random.randrange(6)
    if kind == 0:
        return random.randbytes(random.randrange(40))
    if kind == 1:
        return frame[: random.randrange(len(frame) + 1)]
    if kind == 2:
        return frame + random.randbytes(random.randrange(1, 20))
    if kind == 3:
        return random.randbytes(random.randrange(1, 9)) + frame
    changed = bytearray(frame)
    for _ in range(random.randrange(1, 4)):
        changed[random.randrange(len(changed))] = random.randrange(256)
    return bytes(changed) * (1 + (kind == 5))


def replies(random: Random) -> tuple[Request, bytes]:
    """A request and the PDU of its right reply."""
    function = random.choice((1, 2, 3, 4))
    request = Request(random.choice((1, 2)), function, random.randrange(1000), random.randrange(1, 30))
    return request, bytes([function, request.data_bytes]) + random.randbytes(request.data_bytes)


def test_a_hundred_thousand_harmed_frames_are_judged_without_a_single_exception():
    random, verdicts = Random(5), set()
    for _ in range(50_000):
        request, pdu = replies(random)
        frame = sent_on_tcp(request, 77)[:4] + (1 + len(pdu)).to_bytes(2, "big") + bytes([request.unit]) + pdu
        frames, rest, _ = split_frames(harmed(random, frame))
        verdicts |= {check_tcp(request, 77, one).fault for one in frames}
        assert isinstance(rest, bytes)
        body = bytes([request.unit]) + pdu
        line = check_rtu(request, harmed(random, body + crc(body)))
        verdicts.add(line.fault if line else None)
    assert verdicts >= {
        ReplyFault.TRANSACTION,
        ReplyFault.UNIT,
        ReplyFault.FUNCTION,
        ReplyFault.LENGTH,
        ReplyFault.CHECKSUM,
        ReplyFault.SURPLUS,
    }


def test_a_stream_in_pieces_gives_the_frames_of_the_whole_stream():
    random = Random(6)
    for _ in range(300):
        stream = b"".join(sent_on_tcp(replies(random)[0], random.randrange(1 << 16)) for _ in range(4))
        stream = harmed(random, stream) if random.random() < 0.5 else stream
        frames, rest, broken = split_frames(stream)
        pieces, pending, why = [], b"", None
        for byte in stream:
            if why is None:
                some, pending, why = split_frames(pending + bytes([byte]))
                pieces += some
        assert (pieces, why) == (frames, broken)
        assert broken or pending == rest


def test_a_line_in_pieces_is_never_accepted_where_the_whole_is_refused():
    random = Random(7)
    for _ in range(3000):
        request, pdu = replies(random)
        body = bytes([request.unit]) + pdu
        line = harmed(random, body + crc(body))
        whole = check_rtu(request, line)
        verdicts = [check_rtu(request, line[:n]) for n in range(len(line) + 1)]
        first = next((n for n, verdict in enumerate(verdicts) if verdict is not None), None)
        if first is not None and verdicts[first].fault is None and first < len(line):
            assert whole.fault is ReplyFault.SURPLUS  # and the caller, who waits for silence, sees the surplus too
        elif whole is not None and whole.fault is None:
            assert verdicts[first] == whole


@pytest.mark.parametrize(
    "wrong",
    [
        {"function": 5},
        {"count": 0},
        {"count": 126},
        {"unit": 256},
        {"address": 65535},
        {"address": -1},
        {"words": (1, 2)},
    ],
)
def test_a_request_that_the_protocol_cannot_say_is_a_mistake_of_ours(wrong):
    with pytest.raises(ValueError, match=r"function|unit"):
        Request(**({"unit": 1, "function": 3, "address": 0, "count": 2} | wrong))


@pytest.mark.parametrize(("function", "address", "count"), [(1, 0x0300, 17), (2, 0x0300, 24), (3, 0x0400, 2)])
def test_a_reply_that_is_the_request_itself_is_an_echo_and_no_value(function, address, count):
    """Where the byte count, the data and the checksum of a reply are those of its request, nothing else can tell."""
    request = Request(unit=1, function=function, address=address, count=count)
    echo = bytes([1]) + request.pdu
    assert check_pdu(request, request.pdu).fault is not None
    if function < 3:
        verdict = check_rtu(request, echo + crc(echo))
        assert (verdict.fault, verdict.words) == (ReplyFault.ECHO, ())
        assert check_tcp(request, 5, Frame(5, 1, request.pdu)).fault is ReplyFault.ECHO
