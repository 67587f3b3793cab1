"""Modbus RTU: without transaction ids only silence tells a stray reply from the right one.

What is about timing runs on a virtual clock, the rest on pseudo terminals.
"""

from __future__ import annotations

import asyncio
import os
import resource
from collections import Counter
from collections.abc import Callable, Sequence

import pytest
from link_peers import Device, MemoryLine, PtyPeer, in_virtual_time, within

from hil import parse_address
from hil.client.link import Link
from hil.client.rtu import RtuWire
from hil.client.state import Input
from hil.modbus.framing import crc
from hil.modbus.messages import Reply, ReplyFault, Request
from hil.testing import Send
from recordings import BadInput

TIMEOUT, QUIET, TRAVEL = 0.05, 0.1, 0.002


def of_address(unit: int, function: int, address: int, count: int) -> list[int]:
    return [address + k for k in range(count)]


def read(address: int, unit: int = 1) -> Request:
    return Request(unit=unit, function=3, address=address, count=2)


def right(address: int) -> Reply:
    return Reply((address, address + 1))


class Line:
    """A wire to a device, on a line with exact timing."""

    def __init__(self, harm: Callable[[bytes], Sequence[object]] | None = None) -> None:
        self.tally: Counter[str] = Counter()
        self.device = Device(of_address, harm)
        self.wire = RtuWire(TIMEOUT, QUIET, 0.00175, self.tally, lambda error: None)
        self.memory = MemoryLine(self.wire, self.device, TRAVEL)
        self.wire.connection_made(self.memory)

    async def ask(self, *addresses: int) -> list[Reply]:
        return [await self.wire.exchange(read(address)) for address in addresses]


def asked(harm: Callable[[bytes], Sequence[object]] | None, n: int) -> tuple[list[Reply], Counter[str]]:
    """The replies to reads of the addresses 0, 100, 200, ... and what was dropped."""

    async def story() -> tuple[list[Reply], Counter[str]]:
        line = Line(harm)
        return await line.ask(*[100 * k for k in range(n)]), line.tally

    return in_virtual_time(story())


# Timing


def test_a_late_reply_never_shifts_into_the_next_answer():
    """The device answers in turn and is slow once, as in the report that showed four of eight answers wrong."""
    slow = iter([0.0, 0.0, TIMEOUT + 0.03] + [0.0] * 5)
    replies, _ = asked(lambda frame: [Send(frame, next(slow))], 8)
    assert [reply.fault for reply in replies] == [None, None, ReplyFault.SILENCE, None, None, None, None, None]
    assert all(reply == right(100 * k) for k, reply in enumerate(replies) if k != 2)


@pytest.mark.parametrize("lag", [0.0, 0.001, 0.02, 0.049])
def test_a_repeated_reply_never_becomes_the_answer_to_another_request(lag):
    replies, tally = asked(lambda frame: [Send(frame), Send(frame, lag)], 5)
    assert all(reply.fault is ReplyFault.SURPLUS or reply == right(100 * k) for k, reply in enumerate(replies))
    assert tally["stray bytes on the line"] > 0 or any(reply.fault is ReplyFault.SURPLUS for reply in replies)


def test_a_stray_frame_in_the_place_of_the_reply_takes_both_away():
    """A repetition that comes after the next request was sent: perfect Modbus, and wrong. The true reply betrays it."""
    sent: list[bytes] = []

    def shifted(frame: bytes) -> list[Send]:
        sent.append(frame)
        return [Send(frame)] if len(sent) != 26 else [Send(sent[-2]), Send(frame, 0.0005)]

    replies, _ = asked(shifted, 28)
    assert replies[25].fault is ReplyFault.SURPLUS
    assert all(reply == right(100 * k) for k, reply in enumerate(replies) if k != 25)


class Timed(Line):
    """Reads one after the other, and how long each takes [s]."""

    def __init__(self) -> None:
        super().__init__()
        self.times: list[float] = []

    async def read(self, unit: int = 1, harm: Callable[[bytes], Sequence[object]] | None = None) -> None:
        loop, self.device.harm = asyncio.get_running_loop(), harm
        started = loop.time()
        await self.wire.exchange(read(100 * len(self.times), unit))
        self.times.append(loop.time() - started)


ORDINARY, WATCHED = TRAVEL + 0.00175, TRAVEL + 0.05


def exactly(seconds: float, n: int = 1) -> object:
    return pytest.approx([seconds] * n, rel=0.01)


def test_after_anything_broken_the_line_is_watched_until_twenty_replies_were_clean():
    async def story() -> list[float]:
        line = Timed()
        for k in range(60):
            await line.read(harm=(lambda frame: [Send(frame[:-1])]) if k == 30 else None)
        return line.times

    times = in_virtual_time(story())
    assert times[:1] == exactly(QUIET + TRAVEL + QUIET)  # silence before, and nothing is known yet
    assert times[1:20] == exactly(WATCHED, 19)
    assert times[20:30] == exactly(ORDINARY, 10)
    assert times[30:31] == exactly(TIMEOUT)
    assert times[31:32] == exactly(QUIET + WATCHED)
    assert times[32:51] == exactly(WATCHED, 19)
    assert times[51:] == exactly(ORDINARY, 9)


def test_a_dead_unit_costs_its_neighbours_a_timeout_and_the_quiet_behind_it_and_no_more():
    async def story() -> list[float]:
        line = Timed()
        for _ in range(21):
            await line.read()
        await line.read(unit=2, harm=lambda frame: [])
        await line.read()
        await line.read()
        return line.times[21:]

    assert in_virtual_time(story()) == pytest.approx([TIMEOUT, QUIET + ORDINARY, ORDINARY], rel=0.01)


def test_bytes_that_lie_on_the_line_before_a_request_are_never_its_answer():
    async def story() -> tuple[list[Reply], Counter[str]]:
        line = Line()
        before = await line.ask(0)
        body = bytes.fromhex("010304" + "00010002")
        line.memory.deliver(body + crc(body))  # what a request for address 1 would get
        return before + await line.ask(300), line.tally

    replies, tally = in_virtual_time(story())
    assert replies == [right(0), right(300)]
    assert tally["stray bytes on the line"] == 9


def test_a_line_that_is_never_silent_ends_the_request_and_not_the_program():
    async def story() -> list[Reply]:
        line = Line()

        async def babble() -> None:
            while True:
                line.memory.deliver(b"\x55")
                await asyncio.sleep(QUIET / 2)

        babbling = asyncio.create_task(babble())
        replies = await line.ask(0)
        babbling.cancel()
        return replies

    (reply,) = in_virtual_time(story())
    assert (reply.fault, reply.text) == (ReplyFault.FRAMING, "the line is never silent")


def test_a_cancelled_request_leaves_no_wrong_answer_behind():
    async def story() -> list[Reply]:
        line = Line(lambda frame: [Send(frame, 0.02)])
        await line.ask(0)
        under_way = asyncio.create_task(line.wire.exchange(read(100)))
        await asyncio.sleep(0.01)
        under_way.cancel()
        await asyncio.gather(under_way, return_exceptions=True)
        return await line.ask(200)

    assert in_virtual_time(story()) == [right(200)]


# Pseudo terminals


class Serial:
    """A link on a peer's line, open."""

    def __init__(self, peer: PtyPeer, timeout: float = 5.0, quiet: float = 0.02) -> None:
        self.said: asyncio.Queue[Input] = asyncio.Queue()
        text = f"rtu:{peer.path}?baud=115200&timeout={timeout}&quiet={quiet}"
        self.link = Link(parse_address(text), lambda happening, text: self.said.put_nowait(happening))

    async def __aenter__(self) -> Link:
        self.task = asyncio.create_task(self.link.run())
        assert await within(self.said.get()) is Input.OPENED
        return self.link

    async def __aexit__(self, *_: object) -> None:
        self.task.cancel()
        await asyncio.gather(self.task, return_exceptions=True)


def test_what_the_device_says_on_its_own_is_noticed_and_dropped():
    async def story() -> Reply:
        async with PtyPeer(of_address) as peer, Serial(peer) as link:
            assert await within(link.exchange(read(0))) == right(0)
            peer.write(bytes.fromhex("010304000100022a32"))
            while not link.tally["stray bytes on the line"]:
                await asyncio.sleep(0.001)
            return await within(link.exchange(read(300)))

    assert asyncio.run(story()) == right(300)


def test_an_exception_and_a_foreign_unit_are_told_apart():
    async def story() -> list[ReplyFault | None]:
        async with PtyPeer(lambda unit, *_: 2 if unit == 1 else [0, 0]) as peer, Serial(peer) as link:
            first = await within(link.exchange(read(0)))
            peer.harm = lambda frame: [Send(bytes([9]) + frame[1:])]
            second = await within(link.exchange(read(0, unit=2)))
        return [first.fault, second.fault]

    assert asyncio.run(story()) == [ReplyFault.EXCEPTION, ReplyFault.UNIT]


def test_a_device_that_is_pulled_out_is_noticed_at_once():
    async def story() -> list[object]:
        async with PtyPeer(lambda *_: None) as peer, Serial(peer, timeout=60.0, quiet=0.01) as link:
            asked = asyncio.create_task(link.exchange(read(0)))
            await within(peer.asked.wait())
            peer.unplug()
            return [(await within(asked)).fault, link.open]

    assert asyncio.run(story()) == [ReplyFault.LOST, False]


def test_a_device_that_is_missing_or_busy_or_no_device_is_bad_input(tmp_path):
    nothing = tmp_path / "nothing"
    plain = tmp_path / "plain"
    plain.write_bytes(b"")

    async def busy() -> None:
        async with PtyPeer(of_address) as peer, Serial(peer):
            Link(parse_address(f"rtu:{peer.path}"), lambda happening, text: None)

    with pytest.raises(BadInput, match="is busy"):
        asyncio.run(busy())
    with pytest.raises(BadInput, match="there is no serial device"):
        Link(parse_address(f"rtu:{nothing}"), lambda happening, text: None)
    with pytest.raises(BadInput, match="not a usable serial device"):
        Link(parse_address(f"rtu:{plain}"), lambda happening, text: None)


def test_a_line_works_in_a_process_with_more_than_a_thousand_open_files():
    """`select`, which pyserial uses, knows no descriptor above 1023."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 1200
    if resource.RLIM_INFINITY != hard < wanted:
        pytest.skip(f"this system allows {hard} open files")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, wanted), hard))
    files = [os.open(os.devnull, os.O_RDONLY) for _ in range(1100)]

    async def story() -> Reply:
        async with PtyPeer(of_address) as peer, Serial(peer) as link:
            return await within(link.exchange(read(7)))

    try:
        assert asyncio.run(story()) == right(7)
    finally:
        for descriptor in files:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
