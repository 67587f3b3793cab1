"""Whatever bytes arrive, the server answers or stays silent; nothing escapes into its loop and it goes on serving."""

from __future__ import annotations

import asyncio
import logging
import os
import random
import tty
from collections import Counter
from contextlib import asynccontextmanager

import pytest
from served_ramp import Ramp, connected, device_of, port_of, settings

from hil import Server
from hil.testing import crc

USUAL = (1, 3, 3, 4, 4, 5, 6, 15, 16, 16, 22, 23)
ODD = (0, 2, 7, 8, 11, 12, 17, 20, 21, 24, 43, 90, 128, 131, 255)
PLACES = (0, 0, 0, 0, 0, 2, 4, 20, 20, 24, 1000)
EDGES = (1, 33, 34, 999, 17383, 17384, 32767, 65535)


class Frames:
    """A seeded stream of requests: sensible ones, ones with odd fields, damaged ones, and plain noise."""

    def __init__(self, seed, rtu):
        self.random, self.rtu = random.Random(seed), rtu

    def next(self):
        kind = self.random.random()
        if kind < 0.1:
            return self.random.randbytes(self.random.randrange(1, 300))
        frame = self._framed(self._pdu())
        return frame if kind < 0.7 else self._damaged(bytearray(frame))

    def _word(self):
        pick = self.random
        usual = pick.choice(PLACES)
        return usual if pick.random() < 0.75 else pick.choice((*EDGES, pick.randrange(1 << 16)))

    def _pdu(self):
        pick = self.random
        code = pick.choice(USUAL if pick.random() < 0.8 else ODD)
        head = bytes([code]) + self._word().to_bytes(2, "big")
        if code in {1, 2, 3, 4}:
            return head + pick.choice((1, 2, 2, 8, 8, 34, 0, 120, 125, 126, 2000, 65535)).to_bytes(2, "big")
        if code in {15, 16}:
            data = pick.randbytes(pick.choice((2, 4, 4, 8, 40, 0, 246)))
            count = len(data) // 2 if pick.random() < 0.8 else self._word()
            size = len(data) if pick.random() < 0.8 else pick.randrange(256)
            return head + count.to_bytes(2, "big") + bytes([size]) + data
        if code == 23:
            read = b"\0\1" + self._word().to_bytes(2, "big")
            return head + read + b"\0\2\4" + pick.randbytes(pick.choice((4, 4, 3)))
        return head + pick.randbytes(pick.choice((0, 1, 2, 2, 2, 4, 4, 7)))

    def _framed(self, pdu):
        unit = self.random.choice((1, 1, 1, 1, 1, 1, 2, 2, 0, 247, 255))
        body = bytes([unit]) + pdu
        if self.rtu:
            return body + crc(body)
        length = len(body) if self.random.random() < 0.9 else self.random.choice((0, 1, 2, 255, 65535))
        return self.random.randbytes(2) + b"\0\0" + length.to_bytes(2, "big") + body

    def _damaged(self, frame):
        pick = self.random
        for _ in range(pick.randrange(1, 4)):
            at = pick.randrange(len(frame)) if frame else 0
            change = pick.randrange(4)
            if change == 0 and frame:
                frame[at] ^= 1 << pick.randrange(8)
            elif change == 1:
                frame = frame[:at]
            elif change == 2:
                frame[at:at] = pick.randbytes(pick.randrange(1, 9))
            else:
                frame += frame[at:]
        return bytes(frame)


class Peer:
    """Throws frames at a server and hears what comes back."""

    def __init__(self, address):
        self.address, self.heard = address, bytearray()

    @asynccontextmanager
    async def line(self):
        """A fresh connection, as a function that sends."""
        self.heard.clear()
        loop = asyncio.get_running_loop()
        if self.address.startswith("tcp"):
            transport, _ = await loop.create_connection(lambda: _Ear(self.heard), "127.0.0.1", port_of(self.address))
            try:
                yield transport.write
            finally:
                transport.abort()
            return
        descriptor = os.open(device_of(self.address), os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(descriptor)
        loop.add_reader(descriptor, lambda: self.heard.extend(os.read(descriptor, 4096)))
        try:
            yield lambda data: os.write(descriptor, data)
        finally:
            loop.remove_reader(descriptor)
            os.close(descriptor)


class _Ear(asyncio.Protocol):
    def __init__(self, heard):
        self.heard = heard

    def data_received(self, data):
        self.heard.extend(data)


async def turns(n):
    """Let the event loop go round: what was sent is received, served and answered meanwhile."""
    for _ in range(n):
        await asyncio.sleep(0)


async def attack(server, clock, rtu, frames):
    """Send frames in bursts without waiting for replies; counts the exception codes that come back.

    A burst has a connection of its own on TCP, and half of the frames on the line follow a silence. After every burst
    the server must answer a good request: at once on a new connection, after a silence on the line.
    """
    peer, stream, replies = Peer(server.addresses[int(rtu)]), Frames(7, rtu), Counter()
    burst = 30 if rtu else 6
    for _ in range(frames // burst):
        async with peer.line() as send:
            await turns(8)
            for _ in range(burst):
                clock.now += stream.random.choice((0.0, 1.0))
                send(stream.next())
                await turns(8)
                replies.update(_refusal(peer.heard, rtu))
                peer.heard.clear()
            if rtu:
                await answered(peer, clock, send)
    return replies


def _refusal(heard, rtu):
    """The exception code of a reply, if it is one."""
    at = 1 if rtu else 7
    return [heard[at + 1]] if len(heard) > at + 1 and heard[at] & 0x80 else []


async def answered(peer, clock, send):
    """Ask until the answer comes; what the line still has to deliver may spoil a question."""
    for _ in range(50):
        await asyncio.sleep(0.002)
        clock.now += 1.0
        peer.heard.clear()
        send(bytes.fromhex("010400160001d00e"))
        for _ in range(20):
            await asyncio.sleep(0.0005)
            at = peer.heard.find(b"\x01\x04\x02")
            if at >= 0 and len(peer.heard) >= at + 7 and crc(peer.heard[at : at + 5]) == peer.heard[at + 5 : at + 7]:
                return
    raise AssertionError("the server does not answer any more")


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def fuzzed(rtu, frames):
    async def main():
        escaped, clock = [], Clock()
        asyncio.get_running_loop().set_exception_handler(lambda _loop, context: escaped.append(context))
        s = settings("tcp://127.0.0.1:0", "pty:", speed=None, harm=True)
        async with Server({1: Ramp(), 2: Ramp()}, s, clock) as server:
            replies = await attack(server, clock, rtu, frames)
            served = sum(unit.requests for unit in server.units.values())
            clock.now += 1.0
            for which in (0, 1):
                async with connected(server, which) as client:
                    reply = await client.read_input_registers(0, count=34, device_id=1)
                    assert len(reply.registers) == 34
        assert escaped == []
        assert served > frames // 20
        assert replies[4] == 0, "the server answered 'device failure': something was raised while it served"
        assert min(replies[code] for code in (1, 2, 3)) > frames // 200

    logging.disable(logging.CRITICAL)
    try:
        asyncio.run(main())
    finally:
        logging.disable(logging.NOTSET)


@pytest.mark.parametrize("rtu", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["tcp", "rtu"])
def test_no_frame_disturbs_the_server(rtu):
    fuzzed(rtu, 25_000)


@pytest.mark.long
@pytest.mark.parametrize("rtu", [False, True], ids=["tcp", "rtu"])
def test_no_frame_of_very_many_disturbs_the_server(rtu):
    fuzzed(rtu, 500_000)
