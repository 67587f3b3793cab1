"""The server: registers that are the plant, writes whole or refused, time that follows the clock or an order."""

from __future__ import annotations

import asyncio
import itertools

import numpy as np
import pytest
from pymodbus import ExceptionResponse
from pymodbus.exceptions import ModbusIOException
from served_ramp import SPAN, Clock, Ramp, connected, raw_map, settings

from hil import ActuatorPlant, ActuatorSetup, Point, RegisterMap, Ring, Server, WriteMap, decode, encode
from recordings import BadInput
from simulator.damadics import run_scenario

RING = RegisterMap.load("damadics").ring
POINTS = raw_map().points
WRITE = WriteMap.load("damadics-write")


async def read_all(client, register_map, unit=1):
    """Every point of a map as a plain client reads it."""
    functions = {3: client.read_holding_registers, 4: client.read_input_registers}
    values = {}
    for block in register_map.reads():
        reply = await functions[block.function_code](block.address, count=block.count, device_id=unit)
        assert not reply.isError(), reply
        for point in block.points:
            values[point.name] = decode(point, block.registers_of(point, reply.registers)).value
    return values


async def write(client, name, value, unit=1):
    point = WRITE.point(name)
    if point.table == "coil":
        return await client.write_coil(point.address, bool(value), device_id=unit)
    return await client.write_registers(point.address, encode(point, value), device_id=unit)


def code_of(reply):
    """The exception code of a reply; None for a regular one."""
    return reply.exception_code if isinstance(reply, ExceptionResponse) else None


def test_registers_are_the_plant_over_tcp_and_over_a_pseudo_terminal():
    async def main():
        plant = Ramp()
        async with Server({1: plant}, settings("tcp://127.0.0.1:0", "pty:", speed=None)) as server:
            plant.advance(5)
            for which in (0, 1):
                async with connected(server, which) as client:
                    seen = await read_all(client, raw_map())
                    assert all(seen[name] == 5 / SPAN for name in Ramp.units)
                    assert seen["step"] == pytest.approx(0.0025)
                    assert seen["status"] == 0b0011

    asyncio.run(main())


@pytest.mark.parametrize("name", ["damadics", "positioner-int16"])
def test_the_actuator_reads_through_each_shipped_map(name):
    async def main():
        plant, shipped = ActuatorPlant(ActuatorSetup()), RegisterMap.load(name)
        async with Server({1: plant}, settings(read_map=shipped, speed=None)) as server, connected(server) as client:
            plant.advance(2000)
            truth, seen = plant.signals(), await read_all(client, shipped)
            for point in shipped.points:
                if point.name in truth and point.type != "bit":
                    step = abs(point.scale) if "int" in point.type else abs(truth[point.name]) * 1e-6
                    expected = truth[point.name] * (100 if point.unit == "%" else 1)
                    assert seen[point.name] == pytest.approx(expected, abs=step), point.name

    asyncio.run(main())


def test_lock_step_reproduces_the_simulation_sample_by_sample():
    """Chapter 5's set point, written before each advance; the ring then holds what a simulation in one go gives."""

    async def main():
        recording, _ = run_scenario("chapter5-healthy", duration=31.0)
        setpoint, truth = recording["setpoint"].values / 100, recording["position"].values
        shipped, seen = RegisterMap.load("damadics"), []
        s = settings(read_map=shipped, speed=None)
        async with Server({1: ActuatorPlant(ActuatorSetup())}, s) as server, connected(server) as client:
            await write(client, "setpoint", setpoint[0])
            await write(client, "reset", 1)
            seen += await fetch(client, shipped, 1, 1)
            edges = [0, *np.flatnonzero(np.diff(setpoint)), len(truth) - 1]
            for first, last in itertools.pairwise(edges):
                await write(client, "setpoint", setpoint[first + 1])
                while len(seen) <= last:
                    n = min(2048, last + 1 - len(seen))
                    assert not (await write(client, "advance", n)).isError()
                    seen += await fetch(client, shipped, 1 + len(seen), n)
        assert len(seen) == len(truth)
        assert np.abs(np.array(seen) - truth).max() < 1e-8

    async def fetch(client, shipped, first, n):
        values = []
        while len(values) < n:
            k = first + len(values)
            address, count, most = RING.read_for(shipped.points, k, n - len(values))
            reply = await client.read_input_registers(address, count=count, device_id=1)
            values += [s["position"].value for s in RING.decode(shipped.points, k, reply.registers)[:most]]
        return values

    asyncio.run(main())


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:0", "pty:"])
def test_a_slow_link_fetches_every_sample_from_the_ring(address):
    async def main():
        async with Server({1: Ramp()}, settings(address)) as server, connected(server) as client:
            following, seen = 0, []
            while following < 300:
                at, count, _ = RING.read_for(POINTS, following, 15)
                reply = await client.read_input_registers(at, count=count, device_id=1)
                good = [s for s in RING.decode(POINTS, following, reply.registers) if s is not None]
                seen += [s["position"].value * SPAN for s in good]
                following += len(good)
            assert seen == list(range(following))

    asyncio.run(main())


def test_a_slot_that_was_overwritten_is_recognised():
    async def main():
        async with Server({1: Ramp()}, settings(speed=None)) as server, connected(server) as client:
            server.units[1].advance(2100)
            at, count, n = RING.read_for(POINTS, 45, 15)
            reply = await client.read_input_registers(at, count=count, device_id=1)
            held = [s and s["pressure"].value * SPAN for s in RING.decode(POINTS, 45, reply.registers)]
            assert (n, held) == (15, [None] * 8 + list(range(53, 60)))
            at, count, _ = RING.read_for(POINTS, 2110, 15)
            reply = await client.read_input_registers(at, count=count, device_id=1)
            assert RING.decode(POINTS, 2110, reply.registers) == [None] * 15

    asyncio.run(main())


@pytest.mark.parametrize(("speed", "samples"), [(1.0, 400), (10.0, 4000), (0.5, 200)])
def test_plant_time_follows_the_clock(speed, samples):
    async def main():
        clock = Clock()
        async with Server({1: Ramp()}, settings(speed=speed), clock) as server, connected(server) as client:
            clock.now += 1.0
            while (seen := await read_all(client, raw_map()))["sample_counter"] < samples:
                pass
            seen = await read_all(client, raw_map())
            assert seen["sample_counter"] == samples
            assert int(seen["status"]) & 0b0111 == 0b0001
            report = server.reports()[1]
            assert report.samples == samples
            assert report.maximum == pytest.approx(1.0, abs=0.003 / speed)

    asyncio.run(main())


def test_lateness_is_in_the_registers_and_sets_the_late_bit():
    async def main():
        clock = Clock()
        async with Server({1: Ramp()}, settings(), clock) as server, connected(server) as client:
            clock.now += 0.25
            seen = await read_all(client, raw_map())
            assert seen["lateness_max"] == pytest.approx(0.2475, abs=1e-4)
            assert seen["lateness_p50"] == pytest.approx(0.2475, rel=0.06)
            assert seen["late"] == 1.0
            clock.now += 0.0025
            assert (await read_all(client, raw_map()))["late"] == 0.0

    asyncio.run(main())


def test_plant_time_can_be_held_and_let_go_by_register():
    async def main():
        clock = Clock()
        async with Server({1: Ramp()}, settings(), clock) as server, connected(server) as client:
            clock.now += 0.1
            await write(client, "run", 0)
            clock.now += 50.0
            held = await read_all(client, raw_map())
            assert (held["sample_counter"], held["status"]) == (40, 0)
            await write(client, "run", 1)
            clock.now += 0.1
            assert (await read_all(client, raw_map()))["sample_counter"] == 80

    asyncio.run(main())


def test_writes_are_whole_points_in_range_and_all_or_nothing():
    async def main():
        plant = Ramp()
        async with Server({1: plant}, settings(speed=None, harm=True)) as server, connected(server) as client:
            half, two = [0x3F00, 0], [0x4000, 0]
            assert code_of(await client.write_registers(0, half, device_id=1)) is None
            assert plant.settings_now["setpoint"] == 0.5
            assert (await client.read_holding_registers(0, count=2, device_id=1)).registers == half
            assert code_of(await client.write_register(0, 0, device_id=1)) == 2
            assert code_of(await client.write_registers(1, [0, 0], device_id=1)) == 2
            assert code_of(await client.write_registers(36, [0], device_id=1)) == 2
            assert code_of(await client.write_registers(0, two, device_id=1)) == 3
            assert code_of(await client.write_registers(0, [0x7FC0, 0], device_id=1)) == 3
            assert code_of(await client.write_registers(0, [*half, 0xC000, 0], device_id=1)) == 3
            assert plant.settings_now["upstream_pressure"] == 0.0
            assert code_of(await client.write_registers(0, [0, 0, 0x4974, 0x2400], device_id=1)) is None
            assert (plant.settings_now["setpoint"], plant.settings_now["upstream_pressure"]) == (0.0, 1e6)
            assert code_of(await write(client, "fault", 13)) == 3
            assert code_of(await write(client, "fault", 4)) is None
            assert plant.settings_now["fault"] == 4.0
            assert server.units[1].refused == 6

    asyncio.run(main())


def test_every_writing_function_code_reaches_the_plant():
    async def main():
        plant = Ramp()
        async with Server({1: plant}, settings(speed=None)) as server, connected(server) as client:
            assert code_of(await client.write_register(20, 3, device_id=1)) is None
            assert plant.sample == 3
            assert code_of(await client.mask_write_register(address=20, and_mask=0, or_mask=4, device_id=1)) is None
            assert plant.sample == 7
            reply = await client.readwrite_registers(
                read_address=20, read_count=1, write_address=20, values=[5], device_id=1
            )
            assert reply.registers == [5]
            assert plant.sample == 12
            assert code_of(await client.write_coils(1, [True, True], device_id=1)) is None
            assert (plant.settings_now["noise"], plant.settings_now["lugre"]) == (1.0, 1.0)
            assert (await client.read_coils(0, count=5, device_id=1)).bits[:5] == [True, True, True, False, False]
            assert code_of(await client.write_coil(3, True, device_id=1)) is None
            assert plant.sample == 0

    asyncio.run(main())


@pytest.mark.parametrize("steps", [0, 2049, 65535])
def test_an_advance_that_would_overrun_the_ring_is_refused(steps):
    async def main():
        plant = Ramp()
        async with Server({1: plant}, settings(speed=None)) as server, connected(server) as client:
            assert code_of(await client.write_register(20, steps, device_id=1)) == 3
            assert plant.sample == 0

    asyncio.run(main())


def test_what_may_not_be_written_is_refused():
    async def main():
        plant = Ramp()
        async with Server({1: plant}, settings()) as server, connected(server) as client:
            assert code_of(await write(client, "fault", 4)) == 2
            assert code_of(await client.write_registers(0, [0] * 20, device_id=1)) == 2
            assert code_of(await write(client, "advance", 1)) == 1
        async with Server({1: plant}, settings(write_map=None)) as server, connected(server) as client:
            assert code_of(await write(client, "setpoint", 0.5)) == 2
            assert code_of(await write(client, "run", 0)) == 2
        assert set(plant.settings_now.values()) == {0.0}

    asyncio.run(main())


def test_registers_that_do_not_exist_are_refused_and_holes_inside_a_block_read_zero():
    async def main():
        holes = RegisterMap(
            name="m",
            points=[
                Point(name="position", table="input", address=10, type="float32", unit="m"),
                Point(name="pressure", table="input", address=14, type="float32", unit="Pa"),
                Point(name="drive", table="input", address=40, type="float32"),
            ],
        )
        s = settings(read_map=holes, write_map=None, speed=None)
        async with Server({1: Ramp()}, s) as server, connected(server) as client:
            assert (await client.read_input_registers(10, count=6, device_id=1)).registers == [0] * 6
            for address, count in ((9, 1), (10, 7), (16, 1), (30, 1), (42, 1), (10, 32), (65535, 1)):
                assert code_of(await client.read_input_registers(address, count=count, device_id=1)) == 2
            assert code_of(await client.read_holding_registers(0, count=1, device_id=1)) == 2

    asyncio.run(main())


def test_a_value_beyond_its_register_is_the_nearest_and_no_number_is_the_invalid_marker():
    async def main():
        low = [
            Point(name="position", table="input", address=0, type="int16", unit="m", scale=1e-9),
            Point(name="pressure", table="input", address=1, type="int16", unit="Pa", invalid=(0x8000,)),
            Point(name="drive", table="input", address=2, type="float32"),
        ]
        plant = Ramp()
        plant.signals = lambda: dict.fromkeys(Ramp.units, float("nan")) | {"position": 1.0}
        s = settings(read_map=RegisterMap(name="m", points=low), write_map=None, speed=None)
        async with Server({1: plant}, s) as server, connected(server) as client:
            words = (await client.read_input_registers(0, count=4, device_id=1)).registers
            assert words == [0x7FFF, 0x8000, 0x7FC0, 0]

    asyncio.run(main())


def test_a_counter_wraps_in_its_register():
    async def main():
        points = [Point(name="sample_counter", table="input", address=0, type="uint16")]
        s = settings(read_map=RegisterMap(name="m", points=points), write_map=None, speed=None)
        async with Server({1: Ramp()}, s) as server, connected(server) as client:
            server.units[1].advance(65530)
            server.units[1].advance(10)
            assert (await client.read_input_registers(0, count=1, device_id=1)).registers == [4]

    asyncio.run(main())


def test_several_units_are_plants_of_their_own_and_others_do_not_exist():
    async def main():
        plants = {unit: Ramp() for unit in (1, 2, 7)}
        s = settings("tcp://127.0.0.1:0", "pty:", speed=None)
        async with Server(plants, s) as server:
            async with connected(server) as client:
                await write(client, "advance", 7, unit=7)
                counts = [(await read_all(client, raw_map(), unit))["sample_counter"] for unit in plants]
                assert counts == [0, 0, 7]
                assert code_of(await client.read_input_registers(0, count=1, device_id=3)) == 11
            async with connected(server, 1) as client:
                client.comm_params.timeout_connect = 0.2
                with pytest.raises(ModbusIOException):
                    await client.read_input_registers(0, count=1, device_id=3)
                assert (await read_all(client, raw_map(), 2))["sample_counter"] == 0

    asyncio.run(main())


def test_a_plant_that_breaks_ends_the_server_with_its_reason():
    async def main():
        plant, clock = Ramp(), Clock()

        def broken(_n):
            raise BadInput("actuator", "the simulation is not finite", "check its parameters")

        async with Server({1: plant}, settings(), clock) as server:
            plant.advance = broken
            clock.now += 1.0
            with pytest.raises(BadInput, match="not finite"):
                await server.failed()

    asyncio.run(main())


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([Point(name="position", table="input", address=0, type="uint16", unit="%")], "'m' cannot be converted to '%'"),
        ([Point(name="positon", table="input", address=0, type="uint16")], "no signal of that name"),
        ([Point(name="drive", table="holding", address=1, type="uint16")], "overlaps 'drive' of the reading map"),
    ],
)
def test_a_map_that_does_not_fit_the_plant_is_refused(points, words):
    async def main():
        s = settings(read_map=RegisterMap(name="m", points=points), speed=None)
        with pytest.raises(BadInput, match=words):
            async with Server({1: Ramp()}, s):
                pass

    asyncio.run(main())


def test_a_ring_needs_signals_of_the_plant():
    async def main():
        ring = Ring(address=1000, samples=8, points=("status",))
        with pytest.raises(BadInput, match="'status' is not a signal"):
            async with Server({1: Ramp()}, settings(read_map=raw_map(ring=ring.model_dump()))):
                pass

    asyncio.run(main())
