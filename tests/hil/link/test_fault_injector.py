"""The fault injector: what it makes of a reply, as bytes, and that a real client in front of a real server sees it."""

from __future__ import annotations

import asyncio
import logging

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus import ExceptionResponse
from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient
from pymodbus.exceptions import ModbusException
from served_ramp import Ramp, device_of, port_of, settings

from hil import Server
from hil.testing import (
    MODES,
    Close,
    FaultInjector,
    FaultSchedule,
    FrameCutter,
    RtuFaultInjector,
    Send,
    TcpFaultInjector,
    crc,
)

TCP = bytes.fromhex("1234 0000 0007 01 04 04 3f000000")
RTU = bytes.fromhex("01 04 04 3f000000") + crc(bytes.fromhex("01 04 04 3f000000"))
RTU_MODES = tuple(mode for mode in MODES if mode not in {"wrong_transaction", "close"})


def outcome(mode, frame=TCP, framing="tcp", seed=0, **more):
    """What one reply becomes when a mode is certain."""
    return FaultInjector(FaultSchedule({mode: 1.0}, seed, **more), framing).reply(frame)


def only(actions):
    (action,) = actions
    return action.data


@pytest.mark.parametrize(("frame", "framing"), [(TCP, "tcp"), (RTU, "rtu")])
def test_without_a_fault_a_reply_passes_as_it_is(frame, framing):
    injector = FaultInjector(FaultSchedule({}), framing)
    assert injector.reply(frame) == [Send(frame)]
    assert (injector.replies, injector.counts.total()) == (1, 0)


def test_what_is_lost_late_doubled_or_closed():
    assert outcome("drop") == []
    assert outcome("close") == [Close()]
    assert outcome("duplicate") == [Send(TCP), Send(TCP)]
    assert outcome("delay", delay_s=0.3) == [Send(TCP, 0.3)]
    (late,) = outcome("jitter", jitter_s=0.5)
    assert late.data == TCP
    assert 0.0 < late.after < 0.5
    assert outcome("drip", drip_s=0.01) == [Send(TCP[k : k + 1], 0.01) for k in range(len(TCP))]


@pytest.mark.parametrize("seed", range(20))
def test_what_is_wrong_in_a_frame_that_is_right_in_itself_on_tcp(seed):
    unit = only(outcome("wrong_unit", seed=seed))
    assert unit[:6] + unit[7:] == TCP[:6] + TCP[7:]
    assert unit[6] != 1
    function = only(outcome("wrong_function", seed=seed))
    assert function[:7] + function[8:] == TCP[:7] + TCP[8:]
    assert function[7] != 4
    transaction = only(outcome("wrong_transaction", seed=seed))
    assert transaction[2:] == TCP[2:]
    assert transaction[:2] != TCP[:2]
    refused = only(outcome("exception", seed=seed))
    assert refused[:8] == bytes.fromhex("1234 0000 0003 01 84")
    assert len(refused) == 9
    count = only(outcome("wrong_count", seed=seed))
    assert len(count) != len(TCP)
    assert (count[8], int.from_bytes(count[4:6], "big")) == (len(count) - 9, len(count) - 6)
    other = only(outcome("bad_check", seed=seed))
    assert other[2:4] != b"\0\0"
    assert other[:2] + other[4:] == TCP[:2] + TCP[4:]


@pytest.mark.parametrize("seed", range(20))
def test_on_a_line_the_check_fits_what_was_changed_unless_it_is_the_fault(seed):
    for mode in ("wrong_unit", "wrong_function", "exception", "wrong_count"):
        frame = only(outcome(mode, RTU, "rtu", seed))
        assert frame != RTU
        assert frame[-2:] == crc(frame[:-2])
    spoilt = only(outcome("bad_check", RTU, "rtu", seed))
    assert spoilt[:-2] == RTU[:-2]
    assert spoilt[-2:] != crc(spoilt[:-2])


@pytest.mark.parametrize("seed", range(20))
def test_a_cut_reply_is_a_beginning_and_garbage_is_not_the_reply(seed):
    cut = only(outcome("truncate", seed=seed))
    assert 0 < len(cut) < len(TCP)
    assert TCP.startswith(cut)
    assert only(outcome("garbage", seed=seed)) != TCP


def test_silence_swallows_several_replies_in_a_row():
    injector = FaultInjector(FaultSchedule({"silence": 0.05}, seed=1, silence=4), "tcp")
    passed = [bool(injector.reply(TCP)) for _ in range(400)]
    runs = "".join("1" if p else "0" for p in passed).strip("0").strip("1").split("1")
    lengths = {len(run) for run in runs if run}
    assert min(lengths) == 4
    assert injector.counts["silence"] == passed.count(False)


def test_a_schedule_keeps_its_probabilities_and_repeats_with_its_seed():
    schedule = FaultSchedule({"drop": 0.1, "garbage": 0.2}, seed=3)
    injectors = [FaultInjector(schedule, "tcp") for _ in range(2)]
    runs = [[injector.reply(TCP) for _ in range(5000)] for injector in injectors]
    assert runs[0] == runs[1]
    assert injectors[0].replies == 5000
    # five standard deviations of a binomial
    assert abs(injectors[0].counts["drop"] - 500) < 5 * 21.2
    assert abs(injectors[0].counts["garbage"] - 1000) < 5 * 28.3


def test_even_shares_the_faults_out():
    schedule = FaultSchedule.even(0.9, *MODES, seed=5)
    assert sum(schedule.probability.values()) == pytest.approx(0.9)
    assert schedule.seed == 5


@pytest.mark.parametrize("probability", [{"sabotage": 0.1}, {"drop": -0.1}, {"drop": 0.6, "delay": 0.6}])
def test_an_impossible_schedule_is_refused(probability):
    with pytest.raises(ValueError, match=r"^probability sabotage: there is no such fault|^probability: "):
        FaultSchedule(probability)


@pytest.mark.parametrize("mode", ["close", "wrong_transaction"])
def test_a_line_has_no_transactions_and_nothing_to_close(mode):
    with pytest.raises(ValueError, match="a serial line has no"):
        FaultInjector(FaultSchedule({mode: 0.1}), "rtu")


REPLIES = {
    "tcp": (TCP, bytes.fromhex("0002 0000 0003 01 83 02"), bytes.fromhex("0003 0000 0006 01 06 0001 0002")),
    "rtu": tuple(
        body + crc(body)
        for body in map(bytes.fromhex, ("0104043f000000", "018302", "010600010002", "011600040000ffff"))
    ),
}


@given(st.sampled_from(["tcp", "rtu"]), st.lists(st.integers(0, 2), max_size=6), st.data())
def test_frames_are_found_however_the_stream_is_cut(framing, order, data):
    frames = [REPLIES[framing][k] for k in order]
    stream, cutter, found = b"".join(frames), FrameCutter(framing), []
    while stream:
        n = data.draw(st.integers(1, len(stream)))
        found += cutter.feed(stream[:n])
        stream = stream[n:]
    assert found == frames


@pytest.fixture
def _quiet():
    """The library's client logs every fault; here they are meant."""
    logging.disable(logging.CRITICAL)
    yield
    logging.disable(logging.NOTSET)


async def polled(client, polls):
    """What a plain client makes of its polls: values, refusals, and errors."""
    values, refusals, errors = [], 0, 0
    for _ in range(polls):
        if not client.connected:
            await client.connect()
        try:
            reply = await client.read_input_registers(20, count=3, device_id=1)
        except ModbusException:
            errors += 1
            continue
        if isinstance(reply, ExceptionResponse):
            refusals += 1
        else:
            values.append(reply.registers)
    client.close()
    return values, refusals, errors


def tcp_polled(schedule, polls, timeout=0.05):
    async def main():
        async with Server({1: Ramp()}, settings(speed=None)) as server:
            upstream = port_of(server.addresses[0])
            async with TcpFaultInjector("127.0.0.1", upstream, schedule) as proxy:
                client = AsyncModbusTcpClient(
                    "127.0.0.1", port=proxy.port, timeout=timeout, retries=0, reconnect_delay=0
                )
                return *await polled(client, polls), proxy.injector

    return asyncio.run(main())


def rtu_polled(schedule, polls, timeout=0.05):
    async def main():
        async with (
            Server({1: Ramp()}, settings("pty:", speed=None)) as server,
            RtuFaultInjector(device_of(server.addresses[0]), schedule) as proxy,
        ):
            client = AsyncModbusSerialClient(proxy.path, timeout=timeout, retries=0, reconnect_delay=0)
            return *await polled(client, polls), proxy.injector

    return asyncio.run(main())


@pytest.mark.usefixtures("_quiet")
@pytest.mark.parametrize("poll", [tcp_polled, rtu_polled])
def test_without_faults_a_client_sees_the_server(poll):
    values, refusals, errors, injector = poll(FaultSchedule({}), 50, 2.0)
    assert (values, refusals, errors) == ([[0, 0, 3]] * 50, 0, 0)
    assert (injector.replies, injector.counts.total()) == (50, 0)


@pytest.mark.usefixtures("_quiet")
@pytest.mark.parametrize("poll", [tcp_polled, rtu_polled])
@pytest.mark.parametrize("mode", ["drop", "bad_check", "silence", "wrong_unit"])
def test_what_makes_a_reply_unusable_costs_the_client_that_poll(poll, mode):
    values, refusals, errors, injector = poll(FaultSchedule({mode: 0.3}, seed=2, silence=2), 30)
    assert 0 < injector.counts[mode] <= errors  # on a busy machine a good reply may come too late as well
    assert refusals == 0
    assert values == [[0, 0, 3]] * (30 - errors)


@pytest.mark.usefixtures("_quiet")
@pytest.mark.parametrize("poll", [tcp_polled, rtu_polled])
def test_exceptions_reach_the_client_as_refusals(poll):
    values, refusals, errors, injector = poll(FaultSchedule({"exception": 0.5}, seed=2), 60, 2.0)
    assert refusals == injector.counts["exception"] > 0
    assert (len(values), errors) == (60 - refusals, 0)


@pytest.mark.usefixtures("_quiet")
@pytest.mark.parametrize("poll", [tcp_polled, rtu_polled])
@pytest.mark.parametrize("mode", ["jitter", "drip", "delay"])
def test_a_slow_reply_is_still_the_reply(poll, mode):
    schedule = FaultSchedule({mode: 0.5}, seed=2, delay_s=0.02, jitter_s=0.02, drip_s=0.001)
    values, _, errors, injector = poll(schedule, 20, 2.0)
    assert (values, errors) == ([[0, 0, 3]] * 20, 0)
    assert injector.counts[mode] > 0


@pytest.mark.usefixtures("_quiet")
def test_a_closed_connection_can_be_opened_again():
    values, _, errors, injector = tcp_polled(FaultSchedule({"close": 0.2}, seed=4), 40)
    assert 0 < injector.counts["close"] <= errors
    assert values == [[0, 0, 3]] * (40 - errors)


@pytest.mark.usefixtures("_quiet")
@pytest.mark.parametrize(("poll", "modes"), [(tcp_polled, MODES), (rtu_polled, RTU_MODES)])
def test_all_faults_together_leave_the_injector_working(poll, modes):
    schedule = FaultSchedule.even(0.9, *modes, seed=6, delay_s=0.03, jitter_s=0.005, drip_s=0.0002, silence=2)
    values, _, errors, injector = poll(schedule, 150, 0.02)
    assert set(injector.counts) == set(modes)
    assert errors > 0
    assert [0, 0, 3] in values


def test_a_server_that_is_away_looks_away():
    async def main():
        async with Server({1: Ramp()}, settings(speed=None)) as server:
            upstream = port_of(server.addresses[0])
        async with TcpFaultInjector("127.0.0.1", upstream, FaultSchedule({})) as proxy:
            reader, writer = await asyncio.open_connection("127.0.0.1", proxy.port)
            assert await asyncio.wait_for(reader.read(1), 5) == b""
            writer.close()

    asyncio.run(main())
