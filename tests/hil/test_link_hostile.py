"""The aim that matters most: whatever a peer or a line does to its replies, no wrong value is taken for a good one.

Every answer carries the number of its request, so that a late, repeated, shifted or foreign one is seen to be wrong
even when it is perfect Modbus.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from dataclasses import dataclass, field
from random import Random

import pytest
from link_peers import Device, PtyPeer, TcpPeer, within
from pymodbus import ModbusException
from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient

from hil import FaultInjector, FaultSchedule, Send, parse_address
from hil._checks import Request
from hil._link import Link

TIMEOUT = 0.006
QUIET = 0.012
LATE = 0.008
"""A late reply comes after the timeout, and before the line counts as quiet."""

RTU_MODES = (
    "delay", "jitter", "drop", "duplicate", "truncate", "wrong_unit", "wrong_function",
    "wrong_count", "bad_check", "exception", "silence", "garbage", "drip",
)  # fmt: skip
TCP_MODES = tuple(mode for mode in (*RTU_MODES, "wrong_transaction", "close") if mode != "bad_check")
OWN_MODES = ("repeated later", "the last reply again", "tail of the last in front")


@dataclass
class Tale:
    """What happened: replies that were harmed, answers that were good, and answers that were good and wrong."""

    harmed: Counter[str] = field(default_factory=Counter)
    good: int = 0
    wrong: list[str] = field(default_factory=list)

    @property
    def n_harmed(self) -> int:
        return sum(self.harmed.values())


class Numbered:
    """Answers that name their unit, function, address and request: no two are alike."""

    def __init__(self) -> None:
        self.n = 0

    def __call__(self, unit: int, function: int, address: int, count: int) -> list[int]:
        self.n += 1
        random = Random(f"{unit} {function} {address} {self.n}")
        return [random.getrandbits(1 if function in (1, 2) else 16) for _ in range(count)]


class Harm:
    """The fault injector of the package, and three faults of our own that put replies out of step."""

    def __init__(self, framing: str, share: float, seed: int, tale: Tale) -> None:
        modes = TCP_MODES if framing == "tcp" else RTU_MODES
        schedule = FaultSchedule.even(
            share, *modes, seed=seed, delay_s=LATE, jitter_s=TIMEOUT / 3, drip_s=TIMEOUT / 30, silence=2
        )
        self._injector = FaultInjector(schedule, framing)
        self._random, self._tale, self._framing = Random(seed), tale, framing
        self._before = b""

    def __call__(self, frame: bytes) -> list[object]:
        before, self._before = self._before, frame
        own = self._random.random()
        if own < 0.05:
            return self._count("repeated later", [Send(frame), Send(frame, self._random.uniform(0.0, 0.8 * TIMEOUT))])
        if own < 0.1 and before:
            instead = [] if self._framing == "tcp" else [Send(frame, TIMEOUT / 6)]  # without ids nobody could tell
            return self._count("the last reply again", [Send(before), *instead])
        if own < 0.15 and before:
            cut = self._random.randrange(1, len(before))
            return self._count("tail of the last in front", [Send(before[cut:] + frame)])
        actions = self._injector.reply(frame)
        self._tale.harmed.update(self._injector.counts)
        self._injector.counts.clear()
        return list(actions)

    def _count(self, what: str, actions: list[object]) -> list[object]:
        self._tale.harmed[what] += 1
        return actions


def requests(seed: int) -> list[Request]:
    """Reads that are easily mistaken for each other: few shapes, several units, functions and addresses."""
    random = Random(seed)
    shapes = [(3, 4), (3, 4), (4, 4), (3, 10), (1, 70), (2, 70)]
    return [
        Request(random.choice((1, 2, 3)), *(s := random.choice(shapes))[:1], random.randrange(900), s[1])
        for _ in range(64)
    ]


async def interrogate(address: str, device: Device, tale: Tale, n_harmed: int, seed: int) -> None:
    """Ask until so many replies were harmed, and compare every good answer with what the device meant."""
    link = Link(parse_address(address), lambda happening, text: None)
    keeper = asyncio.create_task(link.run())
    asked, random = requests(seed), Random(seed)
    try:
        while tale.n_harmed < n_harmed:
            if not link.open:
                await asyncio.sleep(0.001)
                continue
            request = random.choice(asked)
            reply = await within(link.exchange(request))
            if reply.fault is None:
                tale.good += 1
                if tuple(reply.words) != tuple(device.truth):
                    tale.wrong.append(f"{address} {request} got {reply.words[:4]}, meant was {device.truth[:4]}")
    finally:
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)


async def interrogate_tcp(n_harmed: int, seed: int, share: float) -> Tale:
    tale = Tale()
    async with TcpPeer(Numbered(), Harm("tcp", share, seed, tale)) as peer:
        await interrogate(f"tcp://127.0.0.1:{peer.port}?timeout={TIMEOUT}", peer, tale, n_harmed, seed)
    return tale


async def interrogate_rtu(n_harmed: int, seed: int, share: float) -> Tale:
    tale = Tale()
    async with PtyPeer(Numbered(), Harm("rtu", share, seed, tale)) as peer:
        address = f"rtu:{peer.path}?baud=115200&parity=N&timeout={TIMEOUT}&quiet={QUIET}"
        await interrogate(address, peer, tale, n_harmed, seed)
    return tale


async def many(n_tcp: int, n_rtu: int, lines: int, seed: int) -> tuple[list[Tale], list[Tale]]:
    """Several lines at once, because they wait most of the time; from rarely harmed to always harmed."""
    shares = [0.2 + 0.65 * k / max(lines - 1, 1) for k in range(lines)]
    tcp = [interrogate_tcp(n_tcp // lines, seed + k, share) for k, share in enumerate(shares)]
    rtu = [interrogate_rtu(n_rtu // lines, seed + 1000 + k, share) for k, share in enumerate(shares)]
    tales = await asyncio.gather(*tcp, *rtu)
    return list(tales[:lines]), list(tales[lines:])


def judge(tales: list[Tale], n_harmed: int) -> None:
    wrong = [text for tale in tales for text in tale.wrong]
    assert not wrong, f"{len(wrong)} wrong values taken for good: {wrong[:3]}"
    assert sum(tale.n_harmed for tale in tales) >= n_harmed
    assert all(tale.good for tale in tales)
    assert sum(tale.good for tale in tales) > n_harmed / 10, "a link that refuses everything is no use either"


def test_twenty_thousand_harmed_replies_give_no_wrong_value():
    tcp, rtu = asyncio.run(many(n_tcp=14_000, n_rtu=6_400, lines=40, seed=1))
    judge(tcp, 14_000)
    judge(rtu, 6_400)
    modes = sum((tale.harmed for tale in tcp + rtu), Counter())
    assert set(modes) >= {
        *TCP_MODES,
        *RTU_MODES,
        "repeated later",
        "the last reply again",
        "tail of the last in front",
    }


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10))
def test_a_million_harmed_replies_give_no_wrong_value(seed):
    tcp, rtu = asyncio.run(many(n_tcp=80_000, n_rtu=20_000, lines=40, seed=10_000 * (seed + 1)))
    judge(tcp, 80_000)
    judge(rtu, 20_000)


async def interrogate_bare(client: AsyncModbusTcpClient | AsyncModbusSerialClient, device: Device, seed: int) -> Tale:
    """The same questions through pymodbus' client alone, believing what it returns without an error."""
    tale, random = Tale(), Random(seed)
    asked = [request for request in requests(seed) if request.function in (3, 4)]
    for _ in range(400):
        if not client.connected:
            await client.connect()
        request = random.choice(asked)
        read = client.read_holding_registers if request.function == 3 else client.read_input_registers
        try:
            reply = await read(request.address, count=request.count, device_id=request.unit)
        except ModbusException:
            continue
        if not reply.isError():
            tale.good += 1
            if tuple(reply.registers) != tuple(device.truth):
                tale.wrong.append(str(request))
    client.close()
    return tale


def test_the_same_harm_makes_a_bare_client_take_wrong_values():
    """Otherwise the harm would prove nothing."""

    async def both() -> tuple[Tale, Tale]:
        async with TcpPeer(Numbered(), Harm("tcp", 0.5, 3, Tale())) as peer:
            client = AsyncModbusTcpClient("127.0.0.1", port=peer.port, timeout=TIMEOUT, retries=0, reconnect_delay=0)
            tcp = await interrogate_bare(client, peer, 3)
        async with PtyPeer(Numbered(), Harm("rtu", 0.5, 3, Tale())) as line:
            serial = AsyncModbusSerialClient(line.path, baudrate=115200, timeout=TIMEOUT, retries=0)
            rtu = await interrogate_bare(serial, line, 3)
        return tcp, rtu

    tcp, rtu = asyncio.run(both())
    assert tcp.wrong
    assert rtu.wrong
