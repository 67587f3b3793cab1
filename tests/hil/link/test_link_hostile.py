"""The aim that matters most: whatever a peer or a line does to its replies, no wrong value is taken for a good one.

Every answer carries the number of its request, so that a late, repeated, shifted or foreign one is seen to be wrong
even when it is perfect Modbus.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass, field
from random import Random
from typing import NamedTuple

import pytest
from link_peers import Device, MemoryLine, PtyPeer, TcpPeer, in_virtual_time, within
from pymodbus import ModbusException
from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient

from hil import parse_address
from hil.client.link import Link
from hil.client.rtu import RtuWire
from hil.modbus.messages import Reply, ReplyFault, Request
from hil.testing import FaultInjector, FaultSchedule, Send


class Pace(NamedTuple):
    """Times in s. A late reply comes after the timeout, and before the line counts as quiet."""

    timeout: float
    late: float
    quiet: float


SWIFT = Pace(timeout=0.006, late=0.008, quiet=0.012)
PTY = Pace(timeout=0.03, late=0.04, quiet=0.12)
"""A pseudo terminal delivers when the system finds the time: on a busy machine tens of ms later."""

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

    def __init__(self, framing: str, pace: Pace, share: float, seed: int, tale: Tale) -> None:
        modes = TCP_MODES if framing == "tcp" else RTU_MODES
        times = {"delay_s": pace.late, "jitter_s": pace.timeout / 3, "drip_s": pace.timeout / 60}
        schedule = FaultSchedule.even(share, *modes, seed=seed, silence=2, **times)
        self._timeout = pace.timeout
        self._injector = FaultInjector(schedule, framing)
        self._random, self._tale, self._framing = Random(seed), tale, framing
        self._before = b""

    def __call__(self, frame: bytes) -> list[object]:
        before, self._before = self._before, frame
        own = self._random.random()
        if own < 0.05:
            return self._count(
                "repeated later", [Send(frame), Send(frame, self._random.uniform(0.0, 0.8 * self._timeout))]
            )
        if own < 0.1 and before:
            instead = [] if self._framing == "tcp" else [Send(frame, self._timeout / 6)]  # else nobody could tell
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
    shapes = [random.choice([(3, 4), (3, 4), (4, 4), (3, 10), (1, 70), (2, 70)]) for _ in range(64)]
    return [Request(random.choice((1, 2, 3)), function, random.randrange(900), count) for function, count in shapes]


Exchange = Callable[[Request], Awaitable[Reply]]


async def interrogate(exchange: Exchange, device: Device, tale: Tale, n_harmed: int, seed: int) -> None:
    """Ask until so many replies were harmed, and compare every good answer with what the device meant."""
    asked, random = requests(seed), Random(seed)
    while tale.n_harmed < n_harmed:
        request = random.choice(asked)
        reply = await exchange(request)
        if reply.fault is None:
            tale.good += 1
            meant = device.meant[request.unit, request.function, request.address, request.count]
            if tuple(reply.words) != tuple(meant):
                tale.wrong.append(f"{request} got {reply.words[:4]}, meant was {meant[:4]}")
        elif reply.fault is ReplyFault.LOST:
            await asyncio.sleep(0.001)


async def over_link(address: str, device: Device, tale: Tale, n_harmed: int, seed: int) -> None:
    link = Link(parse_address(address), lambda happening, text: None)
    keeper = asyncio.create_task(link.run())
    try:
        await interrogate(lambda request: within(link.exchange(request)), device, tale, n_harmed, seed)
    finally:
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)


async def on_tcp(n_harmed: int, seed: int, share: float) -> Tale:
    tale = Tale()
    async with TcpPeer(Numbered(), Harm("tcp", SWIFT, share, seed, tale)) as peer:
        await over_link(f"tcp://127.0.0.1:{peer.port}?timeout={SWIFT.timeout}", peer, tale, n_harmed, seed)
    return tale


async def on_pty(n_harmed: int, seed: int, share: float) -> Tale:
    tale = Tale()
    async with PtyPeer(Numbered(), Harm("rtu", PTY, share, seed, tale)) as peer:
        address = f"rtu:{peer.path}?baud=115200&parity=N&timeout={PTY.timeout}&quiet={PTY.quiet}"
        await over_link(address, peer, tale, n_harmed, seed)
    return tale


async def on_line_in_memory(n_harmed: int, seed: int, share: float) -> Tale:
    """Modbus RTU with exact timing, in virtual time."""
    tale = Tale()
    device = Device(Numbered(), Harm("rtu", SWIFT, share, seed, tale))
    wire = RtuWire(SWIFT.timeout, SWIFT.quiet, 0.00175, Counter(), lambda error: None)
    wire.connection_made(MemoryLine(wire, device, travel=0.0007))
    await interrogate(wire.exchange, device, tale, n_harmed, seed)
    return tale


Setting = Callable[[int, int, float], Awaitable[Tale]]


async def many(setting: Setting, n_harmed: int, lines: int, seed: int) -> list[Tale]:
    """Several lines at once, because they wait most of the time; from rarely harmed to nearly always harmed."""
    shares = [0.2 + 0.65 * k / (lines - 1) for k in range(lines)]
    return list(
        await asyncio.gather(*[setting(-(-n_harmed // lines), seed + k, share) for k, share in enumerate(shares)])
    )


def judge(tales: list[Tale], n_harmed: int, modes: Iterable[str], least_good: float = 0.1) -> None:
    wrong = [text for tale in tales for text in tale.wrong]
    assert not wrong, f"{len(wrong)} wrong values taken for good: {wrong[:3]}"
    harmed = sum((tale.harmed for tale in tales), Counter[str]())
    assert harmed.total() >= n_harmed
    assert set(harmed) == {*modes, *OWN_MODES}
    assert all(tale.good for tale in tales)
    assert sum(tale.good for tale in tales) > n_harmed * least_good, "a link that refuses everything is no use either"


@pytest.mark.parametrize(("n_harmed", "lines"), [(4_000, 20), pytest.param(17_000, 80, marks=pytest.mark.slow)])
def test_thousands_of_harmed_replies_on_tcp_give_no_wrong_value(n_harmed, lines):
    tales = asyncio.run(many(on_tcp, n_harmed, lines, seed=1))
    judge(tales, n_harmed, TCP_MODES, 0.05)  # a proof can be harmed, too


@pytest.mark.parametrize("n_harmed", [1_000, pytest.param(3_000, marks=pytest.mark.slow)])
def test_thousands_of_harmed_replies_on_pseudo_terminals_give_no_wrong_value(n_harmed):
    judge(asyncio.run(many(on_pty, n_harmed, lines=80, seed=1)), n_harmed, RTU_MODES)


def test_ten_thousand_harmed_replies_on_a_line_with_exact_timing_give_no_wrong_value():
    judge(in_virtual_time(many(on_line_in_memory, 10_000, lines=10, seed=1)), 10_000, RTU_MODES)


@pytest.mark.long
@pytest.mark.parametrize(
    ("setting", "n_harmed", "lines", "modes"),
    [(on_tcp, 400_000, 40, TCP_MODES), (on_line_in_memory, 580_000, 100, RTU_MODES), (on_pty, 20_000, 100, RTU_MODES)],
)
def test_a_million_harmed_replies_give_no_wrong_value(setting, n_harmed, lines, modes):
    run = in_virtual_time if setting is on_line_in_memory else asyncio.run
    judge(run(many(setting, n_harmed, lines, seed=100_000)), n_harmed, modes, 0.05)


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
        async with TcpPeer(Numbered(), Harm("tcp", SWIFT, 0.5, 3, Tale())) as peer:
            client = AsyncModbusTcpClient(
                "127.0.0.1", port=peer.port, timeout=SWIFT.timeout, retries=0, reconnect_delay=0
            )
            tcp = await interrogate_bare(client, peer, 3)
        async with PtyPeer(Numbered(), Harm("rtu", SWIFT, 0.5, 3, Tale())) as line:
            serial = AsyncModbusSerialClient(line.path, baudrate=115200, timeout=SWIFT.timeout, retries=0)
            rtu = await interrogate_bare(serial, line, 3)
        return tcp, rtu

    tcp, rtu = asyncio.run(both())
    assert tcp.wrong
    assert rtu.wrong
