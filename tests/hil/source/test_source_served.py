"""The source against the package's own server: polled, sample by sample, in lock-step, over every kind of link."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import numpy as np
import pytest
from link_peers import within
from served_ramp import SPAN, Ramp, raw_map, settings

from hil import (
    Certificates,
    LinkEvent,
    LiveSource,
    Polling,
    Recorder,
    RecorderSettings,
    RingReading,
    Sample,
    Server,
    WriteMap,
    parse_address,
    valves_of,
)
from hil.testing import make_loopback_authority
from recordings import read


async def taken(source: LiveSource, n: int) -> tuple[list[Sample], list[LinkEvent]]:
    samples: list[Sample] = []
    events: list[LinkEvent] = []
    while len(samples) < n:
        item = await within(anext(source))
        (samples if isinstance(item, Sample) else events).append(item)
    return samples, events


def address_of(server: Server, client: Certificates | None = None) -> str:
    """How our side writes the server's first address."""
    where = server.addresses[0]
    if client is None:
        return f"{where}&quiet=0.05" if where.startswith("rtu:") else where
    return f"{where}?ca={client.authority}&cert={client.certificate}&key={client.key}"


@pytest.mark.parametrize("listen", ["tcp://127.0.0.1:0", "pty:", "tls://127.0.0.1:0"])
def test_three_served_valves_are_polled(listen, tmp_path):
    sides = make_loopback_authority(tmp_path) if listen.startswith("tls") else None

    async def story() -> list[Sample]:
        plants = {unit: Ramp() for unit in (1, 2, 3)}
        async with Server(plants, settings(listen, certificates=sides and sides.server)) as server:
            where = parse_address(address_of(server, sides and sides.client))
            async with LiveSource(where, valves_of(raw_map(), (1, 2, 3)), Polling(None)) as source:
                samples, _ = await taken(source, 30)
                return samples

    samples = asyncio.run(story())
    assert {sample.valve for sample in samples} == {"damadics-1", "damadics-2", "damadics-3"}
    for sample in samples:
        assert sample.good
        numbers = {round(sample[name].value * SPAN) for name in ("position", "pressure", "setpoint")}
        assert numbers == {int(sample["sample_counter"].value)}  # of one sample, none mixed


@pytest.mark.parametrize("listen", ["tcp://127.0.0.1:0", "pty:"])
def test_every_sample_of_a_running_plant_is_fetched(listen):
    async def story() -> tuple[list[Sample], list[LinkEvent]]:
        async with Server({1: Ramp()}, settings(listen)) as server:
            where = parse_address(address_of(server))
            async with LiveSource(where, valves_of(raw_map()), RingReading(5.0)) as source:
                return await taken(source, 600)

    samples, events = asyncio.run(story())
    numbers = [round(sample["position"].value * SPAN) for sample in samples]
    assert numbers == list(range(numbers[0], numbers[0] + 600))
    assert all(later.time - earlier.time == pytest.approx(0.0025, abs=1e-9) for earlier, later in pairwise(samples))
    assert [event.kind for event in events] == ["link_up"]


def test_a_plant_in_lock_step_is_advanced_and_recorded_sample_by_sample(tmp_path):
    async def story() -> None:
        async with Server({1: Ramp()}, settings(speed=None)) as server:
            options = {"write_map": WriteMap.load("damadics-write"), "allow_write": True}
            where = parse_address(address_of(server))
            async with LiveSource(where, valves_of(raw_map()), RingReading(100.0), **options) as source:
                stop = asyncio.Event()
                recording = asyncio.create_task(Recorder(source, RecorderSettings(tmp_path / "run.h5")).run(stop))
                while source.statistics.samples < 1:
                    await asyncio.sleep(0.005)
                for k in range(1, 6):
                    await source.write("damadics", "advance", 100)
                    while source.statistics.samples < 1 + 100 * k:
                        await asyncio.sleep(0.005)
                stop.set()
                await within(recording)

    asyncio.run(within(story(), 60.0))
    recording = read(tmp_path / "run.h5")
    assert (recording["position"].values * SPAN).tolist() == list(range(501))
    assert np.allclose(recording.time, 0.0025 * np.arange(501), atol=1e-9)
