"""Fetching every sample from a device's ring: none twice, none missed without a `gap`, whatever the link does."""

from __future__ import annotations

import asyncio
import re
import struct
from collections.abc import Sequence
from itertools import pairwise

import pytest
from link_peers import PtyPeer, TcpPeer, within

from hil import LinkEvent, LiveSource, Polling, RegisterMap, RingReading, Sample, open_source, parse_address, valves_of
from recordings import BadInput

SLOTS, SIZE, AT = 64, 4, 100
MODULUS = 100_000  # a float32 holds these exactly
MAP = RegisterMap.model_validate(
    {
        "name": "rig",
        "max_read": 40,
        "points": [
            {"table": "input", "address": 0, "type": "uint32", "name": "sample_counter"},
            {"table": "input", "address": 2, "type": "float32", "unit": "s", "name": "step"},
            {"table": "input", "address": 10, "type": "float32", "unit": "mm", "name": "position"},
        ],
        "ring": {"address": AT, "samples": SLOTS, "points": ["position"]},
    }
)


def registers(code: str, value: float) -> tuple[int, ...]:
    return struct.unpack(">2H", struct.pack(code, value))


class RingDevice:
    """A device whose sample number k has the position k % MODULUS; how many it has made is for the test to say."""

    def __init__(self, newest: int = 0, advance: int = 0) -> None:
        self.newest, self.advance = newest, advance  # samples made at each look
        self.step = 0.0025

    def __call__(self, unit: int, function: int, address: int, count: int) -> Sequence[int]:
        if address == 0 and count > 1:  # one register alone is asked for as a proof
            self.newest += self.advance
            return [*registers(">I", self.newest % (1 << 32)), *registers(">f", self.step)]
        first = (address - AT) // SIZE
        return [word for slot in range(first, first + count // SIZE) for word in self._slot(slot)]

    def _slot(self, slot: int) -> Sequence[int]:
        number = self.newest - (self.newest - slot) % SLOTS
        if number < 0:
            return [0xFFFF, 0xFFFF, 0, 0]
        return [*registers(">I", number % (1 << 32)), *registers(">f", float(number % MODULUS))]


async def fetched(source: LiveSource, n: int) -> tuple[list[Sample], list[LinkEvent]]:
    """The next samples, and the gaps between them."""
    samples: list[Sample] = []
    gaps: list[LinkEvent] = []
    while len(samples) < n:
        item = await within(anext(source))
        if isinstance(item, Sample):
            samples.append(item)
        elif item.kind == "gap":
            gaps.append(item)
    return samples, gaps


def over_tcp(device: RingDevice, n: int, plan: RingReading | None = None) -> tuple[list[Sample], list[LinkEvent]]:
    async def story() -> tuple[list[Sample], list[LinkEvent]]:
        async with TcpPeer(device) as peer:
            address = parse_address(f"tcp://127.0.0.1:{peer.port}")
            async with LiveSource(address, valves_of(MAP), plan or RingReading(500.0)) as source:
                return await fetched(source, n)

    return asyncio.run(story())


def test_every_sample_comes_once_in_order_at_the_devices_own_times():
    samples, gaps = over_tcp(RingDevice(newest=1000, advance=17), 400)
    assert [sample["position"].value for sample in samples] == list(range(1017, 1417))
    assert all(abs(later.time - earlier.time - 0.0025) < 1e-9 for earlier, later in pairwise(samples))
    assert not gaps
    assert samples[0]["position"].unit == "mm"


def test_a_slow_serial_line_loses_no_sample():
    async def story() -> tuple[list[Sample], list[LinkEvent]]:
        async with PtyPeer(RingDevice(advance=30)) as peer:
            address = parse_address(f"rtu:{peer.path}?baud=115200&parity=N&timeout=0.5&quiet=0.01")
            async with LiveSource(address, valves_of(MAP), RingReading(20.0)) as source:
                return await fetched(source, 200)

    samples, gaps = asyncio.run(story())
    assert [sample["position"].value for sample in samples] == list(range(30, 230))
    assert not gaps


class Slowing(RingDevice):
    """Makes more than can be read at first, and later nothing that cannot."""

    def __call__(self, unit: int, function: int, address: int, count: int) -> Sequence[int]:
        if self.newest > 2000:
            self.advance = 5
        return super().__call__(unit, function, address, count)


def test_a_ring_that_was_overrun_is_a_gap_that_says_which_samples_are_lost_and_when_over_how_many():
    samples, gaps = over_tcp(Slowing(advance=200), 1500, RingReading(200.0, quiet_s=0.1))
    numbers = [int(sample["position"].value) for sample in samples]
    assert numbers[0] == 200
    assert numbers == sorted(set(numbers))
    lost = set(range(200, numbers[-1])) - set(numbers)
    begun, over = gaps
    first, last = map(int, re.search(r"overrun: samples (\d+) to (\d+) are lost", begun.text).groups())
    assert set(range(first, last + 1)) <= lost
    assert int(re.search(r"read in time again; (\d+) samples", over.text)[1]) == len(lost) > last - first + 1
    later = {round((sample.time - samples[0].time) / 0.0025) for sample in samples}
    assert later == {number - 200 for number in numbers}  # the clock goes on over the gap


def test_a_device_that_counts_anew_is_a_gap_and_time_goes_on():
    async def story() -> tuple[list[Sample], list[LinkEvent], list[Sample]]:
        device = RingDevice(newest=5000, advance=5)
        async with TcpPeer(device) as peer:
            address = parse_address(f"tcp://127.0.0.1:{peer.port}")
            async with LiveSource(address, valves_of(MAP), RingReading(500.0)) as source:
                before, _ = await fetched(source, 50)
                device.newest = 0
                after, gaps = await fetched(source, 200)
                return before, gaps, after

    before, gaps, after = asyncio.run(story())
    assert len(gaps) == 1
    assert "counts anew" in gaps[0].text
    assert all(earlier.time < later.time for earlier, later in pairwise(before + after))


def test_a_counter_that_wraps_around_is_no_gap():
    samples, gaps = over_tcp(RingDevice(newest=(1 << 32) - 100, advance=17), 300)
    first = (1 << 32) - 83
    assert [sample["position"].value for sample in samples] == [(first + k) % MODULUS for k in range(300)]
    assert all(abs(later.time - earlier.time - 0.0025) < 1e-9 for earlier, later in pairwise(samples))
    assert not gaps


def test_a_device_that_stands_still_is_told_once():
    async def story() -> list[str]:
        device = RingDevice(newest=10)
        async with TcpPeer(device) as peer:
            address = parse_address(f"tcp://127.0.0.1:{peer.port}")
            async with LiveSource(address, valves_of(MAP), RingReading(200.0)) as source:
                await fetched(source, 1)
                gap = await within(anext(source))
                device.advance = 1
                _, more = await fetched(source, 20)
                return [gap.text, *[one.text for one in more]]

    texts = asyncio.run(story())
    assert len(texts) == 1
    assert "has made no new sample for" in texts[0]


def test_a_map_without_a_ring_or_without_its_points_is_bad_input():
    plain = MAP.model_copy(update={"ring": None})
    with pytest.raises(BadInput, match="no ring of samples"):
        open_source("tcp://127.0.0.1:5020", valves_of(plain), RingReading())
    without = MAP.model_copy(update={"points": MAP.points[:1] + MAP.points[2:]})
    with pytest.raises(BadInput, match="there is no point 'step'"):
        open_source("tcp://127.0.0.1:5020", valves_of(without), RingReading())
    assert Polling(1.0).signals(valves_of(plain)[0])
