"""Modbus RTU on pseudo terminals: without transaction ids only silence tells a stray reply from the right one."""

from __future__ import annotations

import asyncio
import os
import resource
from collections import Counter

import pytest
from link_peers import PtyPeer, within

from hil import Send, parse_address
from hil._checks import Fault, Reply, Request, crc16
from hil._link import Link
from hil._link_state import Input
from recordings import BadInput

TIMEOUT, QUIET = 0.05, 0.1


def of_address(unit: int, function: int, address: int, count: int) -> list[int]:
    return [address + k for k in range(count)]


def read(address: int, unit: int = 1) -> Request:
    return Request(unit=unit, function=3, address=address, count=2)


def right(address: int) -> Reply:
    return Reply((address, address + 1))


class Serial:
    """A link on a peer's line, open."""

    def __init__(self, peer: PtyPeer, timeout: float = TIMEOUT, quiet: float = QUIET) -> None:
        self.said: asyncio.Queue[Input] = asyncio.Queue()
        text = f"rtu:{peer.path}?baud=115200&parity=N&timeout={timeout}&quiet={quiet}"
        self.link = Link(parse_address(text), lambda happening, text: self.said.put_nowait(happening))

    async def __aenter__(self) -> Link:
        self.task = asyncio.create_task(self.link.run())
        assert await within(self.said.get()) is Input.OPENED
        return self.link

    async def __aexit__(self, *_: object) -> None:
        self.task.cancel()
        await asyncio.gather(self.task, return_exceptions=True)


def test_a_late_reply_never_shifts_into_the_next_answer():
    """The device answers in turn and is slow once, as in the report that showed four of eight answers wrong."""

    async def story() -> list[Reply]:
        slow = iter([0.0, 0.0, TIMEOUT + 0.03] + [0.0] * 5)
        async with PtyPeer(of_address, lambda frame: [Send(frame, next(slow))]) as peer, Serial(peer) as link:
            return [await within(link.exchange(read(100 * k))) for k in range(8)]

    replies = asyncio.run(story())
    assert [reply.fault for reply in replies] == [None, None, Fault.SILENCE, None, None, None, None, None]
    assert all(reply == right(100 * k) for k, reply in enumerate(replies) if k != 2)


@pytest.mark.parametrize("lag", [0.0, 0.02])
def test_a_repeated_reply_never_becomes_the_answer_to_another_request(lag):
    async def story() -> tuple[list[Reply], Counter[str]]:
        def twice(frame: bytes) -> list[Send]:
            return [Send(frame), Send(frame, lag)]

        async with PtyPeer(of_address, twice) as peer, Serial(peer) as link:
            return [await within(link.exchange(read(100 * k))) for k in range(5)], link.tally

    replies, tally = asyncio.run(story())
    assert all(reply.fault is Fault.SURPLUS or reply == right(100 * k) for k, reply in enumerate(replies))
    assert tally[Fault.SURPLUS] + tally["stray bytes on the line"] > 0


def test_a_stray_frame_in_the_place_of_the_reply_takes_both_away():
    """A repetition that comes after the next request was sent: perfect Modbus, and wrong. The true reply betrays it."""

    async def story() -> list[Reply]:
        sent: list[bytes] = []

        def shifted(frame: bytes) -> list[Send]:
            sent.append(frame)
            return [Send(frame)] if len(sent) != 16 else [Send(sent[-2]), Send(frame, 0.001)]

        async with PtyPeer(of_address, shifted) as peer, Serial(peer) as link:
            return [await within(link.exchange(read(100 * k))) for k in range(18)]

    replies = asyncio.run(story())
    assert replies[15].fault is Fault.SURPLUS
    assert all(reply == right(100 * k) for k, reply in enumerate(replies) if k != 15)


def test_bytes_that_lie_on_the_line_before_a_request_are_never_its_answer():
    async def story() -> tuple[Reply, Counter[str]]:
        async with PtyPeer(of_address) as peer, Serial(peer) as link:
            assert await within(link.exchange(read(0))) == right(0)
            body = bytes.fromhex("010304" + "00010002")
            peer.write(body + crc16(body).to_bytes(2, "little"))  # what a request for address 1 would get
            return await within(link.exchange(read(300))), link.tally

    reply, tally = asyncio.run(story())
    assert reply == right(300)
    assert tally["stray bytes on the line"] == 9


def test_a_line_that_is_never_silent_ends_the_request_and_not_the_program():
    async def story() -> Reply:
        async with PtyPeer(of_address) as peer, Serial(peer, timeout=0.01, quiet=0.02) as link:
            stop = asyncio.Event()

            async def babble() -> None:
                while not stop.is_set():
                    peer.write(b"\x55")
                    await asyncio.sleep(0.002)

            babbling = asyncio.create_task(babble())
            reply = await within(link.exchange(read(0)))
            stop.set()
            await babbling
            return reply

    assert asyncio.run(story()).fault is Fault.FRAMING


def test_a_cancelled_request_leaves_no_wrong_answer_behind():
    async def story() -> Reply:
        async with PtyPeer(of_address, lambda frame: [Send(frame, 0.02)]) as peer, Serial(peer) as link:
            asked = asyncio.create_task(link.exchange(read(100)))
            await within(peer.asked.wait())
            asked.cancel()
            return await within(link.exchange(read(200)))

    assert asyncio.run(story()) == right(200)


def test_an_exception_and_a_foreign_unit_are_told_apart():
    async def story() -> list[Fault | None]:
        async with PtyPeer(lambda unit, *_: 2 if unit == 1 else [0, 0]) as peer, Serial(peer) as link:
            first = await within(link.exchange(read(0)))
            peer.harm = lambda frame: [Send(bytes([9]) + frame[1:])]
            second = await within(link.exchange(read(0, unit=2)))
        return [first.fault, second.fault]

    assert asyncio.run(story()) == [Fault.EXCEPTION, Fault.UNIT]


def test_a_device_that_is_pulled_out_is_noticed_at_once():
    async def story() -> list[object]:
        async with PtyPeer(lambda *_: None) as peer, Serial(peer, timeout=60.0, quiet=0.01) as link:
            asked = asyncio.create_task(link.exchange(read(0)))
            await within(peer.asked.wait())
            peer.unplug()
            return [(await within(asked)).fault, link.open]

    assert asyncio.run(story()) == [Fault.LOST, False]


def test_a_device_that_is_missing_or_busy_or_no_device_is_bad_input(tmp_path):
    nothing = tmp_path / "nothing"
    plain = tmp_path / "plain"
    plain.write_bytes(b"")

    async def busy() -> None:
        async with PtyPeer(of_address) as peer, Serial(peer):
            Link(parse_address(f"rtu:{peer.path}?parity=N"), lambda happening, text: None)

    with pytest.raises(BadInput, match="another program has it open"):
        asyncio.run(busy())
    with pytest.raises(BadInput, match="there is no device"):
        Link(parse_address(f"rtu:{nothing}"), lambda happening, text: None)
    with pytest.raises(BadInput, match="cannot be opened"):
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
