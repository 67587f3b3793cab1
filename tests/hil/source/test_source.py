"""The source over live links: samples with their quality, events, and no silence that nobody notices."""

from __future__ import annotations

import asyncio
import re
import time
from collections.abc import Callable, Sequence
from itertools import islice

import pytest
from link_peers import PtyPeer, TcpPeer, within
from link_rig import MAP, Rig, event, samples, words_of

from hil import (
    LinkEvent,
    LiveSource,
    Polling,
    PollingStopped,
    Quality,
    RegisterMap,
    Sample,
    Valve,
    WriteMap,
    parse_address,
    valves_of,
)
from hil.modbus.framing import Frame
from hil.testing import Send
from recordings import BadInput, LinkError, ProtocolError


def live(
    peer: TcpPeer | PtyPeer, plan: Polling | None = None, units: Sequence[int] = (), options: str = ""
) -> LiveSource:
    if isinstance(peer, PtyPeer):
        address = f"rtu:{peer.path}?baud=115200&parity=N{options}"
    else:
        address = f"tcp://127.0.0.1:{peer.port}?{options.lstrip('&')}".rstrip("?")
    return LiveSource(parse_address(address), valves_of(MAP, units), plan or Polling(None))


# Samples


def test_a_sample_has_times_values_units_and_quality():
    async def story() -> tuple[list[Sample], LinkEvent]:
        async with TcpPeer(Rig()) as peer, live(peer) as source:
            up = await event(source, "link_up")
            return await samples(source, 3), up

    taken, up = asyncio.run(story())
    first = taken[0]
    assert (first.valve, first["position"].value, first["position"].unit) == ("rig", 12.5, "mm")
    assert first.good
    assert first["alarm"].value == 0.0
    assert [sample["counter"].value for sample in taken] == [1, 2, 3]
    assert first.time < taken[1].time < taken[2].time
    assert all(one.time - 1.0 < reading.time < one.time + 1.0 for one in taken for reading in one.readings.values())
    assert abs(first.wall - up.wall) < 60.0
    assert up.text == "unit 1: it answers"


def test_a_value_out_of_range_or_not_a_number_is_bad_with_a_reason_and_one_event():
    async def story() -> tuple[list[Sample], list[str]]:
        rig = Rig()
        async with TcpPeer(rig) as peer, live(peer) as source:
            good = await samples(source, 1)
            rig.value = 77.0
            text = [(await event(source, "bad_value")).text]
            outside = await samples(source, 1)
            rig.value = float("nan")
            while not (nan := (await samples(source, 1))[0])["position"].reason.startswith("not finite"):
                pass
            rig.value = 12.5
            text.append((await event(source, "bad_value")).text)
            return [*good, *outside, nan, *await samples(source, 1)], text

    (good, outside, nan, after), texts = asyncio.run(story())
    assert good.good
    assert outside["position"].quality is Quality.OUT_OF_RANGE
    assert outside["position"].reason == "77 outside 0 to 50 mm"
    assert outside["counter"].good  # only what is wrong is bad
    assert nan["position"].usable != nan["position"].usable
    assert texts[0] == "position: out of range: 77 outside 0 to 50 mm"
    assert texts[1].startswith("position: good again, ")
    assert after.good


def two_reads(name: str) -> Valve:
    """A valve whose points come in two replies."""
    points = [{"name": f"p{k}", "table": table, "address": 0, "type": "uint16"} for k, table in TABLES]
    return Valve(name, RegisterMap.model_validate({"name": name, "points": points}))


TABLES = ((1, "holding"), (2, "input"))


def test_values_before_a_loss_in_the_same_round_stay_good_each_with_its_own_time():
    async def story() -> tuple[Sample, Sample]:
        def answer(unit: int, function: int, address: int, count: int) -> list[int] | None:
            losses.append(function)
            if function == 4 and losses.count(4) == 3:
                peer.drop()
                return None
            return [len(losses)]

        losses: list[int] = []
        peer = TcpPeer(answer)
        async with peer:
            address = parse_address(f"tcp://127.0.0.1:{peer.port}")
            async with LiveSource(address, [two_reads("V")], Polling(None)) as source:
                whole = (await samples(source, 1))[0]
                while (last := (await samples(source, 1))[0]).good:
                    pass
                return whole, last

    whole, last = asyncio.run(story())
    assert whole["p1"].time < whole["p2"].time
    assert last["p1"].good
    assert last["p2"].quality is Quality.LINK
    assert last["p1"].time <= last.time


def test_an_exception_reply_makes_every_value_of_its_block_bad():
    async def story() -> Sample:
        rig = Rig()
        async with TcpPeer(lambda *request: 6 if rig.n > 2 else rig(*request)) as peer, live(peer) as source:
            await samples(source, 3)
            return (await samples(source, 1))[0]

    sample = asyncio.run(story())
    assert {reading.quality for reading in sample.readings.values()} == {Quality.NOT_VALID}
    assert sample["position"].reason == "exception 6: device busy"


def test_a_heartbeat_that_stands_still_makes_everything_stale():
    async def story() -> tuple[list[Sample], str]:
        rig = Rig()
        plan = Polling(None, heartbeat="counter", heartbeat_s=0.05)
        stuck = TcpPeer(lambda *request: words_of(1.0, min(rig.n, 3)) if rig(*request) else None)
        async with stuck as peer, live(peer, plan) as source:
            before = await samples(source, 1)
            text = (await event(source, "bad_value")).text
            return before + await samples(source, 1), text

    (before, after), text = asyncio.run(story())
    assert before.good
    assert {reading.quality for reading in after.readings.values()} == {Quality.STALE}
    assert after["position"].value == 1.0  # a human may look at it,
    assert after["position"].usable != after["position"].usable  # nothing may compute with it
    assert "the heartbeat 'counter' has not changed" in text


def test_polling_at_a_rate_keeps_its_deadlines_and_counts_those_it_missed():
    async def story() -> tuple[float, int]:
        async with TcpPeer(Rig()) as peer, live(peer, Polling(200.0)) as source:
            taken = await samples(source, 41)
            return (taken[-1].time - taken[0].time) / 40, source.statistics.missed + len(taken)

    period, n_deadlines = asyncio.run(story())
    assert period >= 0.0049  # never faster than asked for
    assert n_deadlines >= 41


def test_a_lasting_overload_is_told_when_it_begins_and_with_its_count_when_it_is_over():
    async def story() -> tuple[list[str], int]:
        rig = Rig()

        def answer(*request: int) -> Sequence[int] | int | None:
            if source.statistics.missed < 60:
                time.sleep(0.03)  # busy with something else, six periods long
            return rig(*request)

        async with TcpPeer(answer) as peer:
            source = live(peer, Polling(200.0, quiet_s=0.3))
            async with source:
                begun = await event(source, "deadline_missed")
                assert source.statistics.missed < 60
                over = await event(source, "deadline_missed")
                return [begun.text, over.text], source.statistics.missed

    (begun, over), missed = asyncio.run(story())
    assert re.match(r"\d+ deadlines? missed: a round began \S+ s late", begun)
    n_missed, lasted_s = re.match(r"deadlines are kept again; (\d+) were missed in (\S+) s", over).groups()
    assert 60 <= int(n_missed) <= missed
    assert float(lasted_s) > 0.0


def test_the_same_samples_come_over_a_serial_line():
    async def story() -> list[Sample]:
        async with PtyPeer(Rig()) as peer, live(peer, options="&timeout=0.2&quiet=0.01") as source:
            return await samples(source, 12)

    taken = asyncio.run(story())
    assert [sample["counter"].value for sample in taken] == list(range(1, 13))
    assert all(sample.good for sample in taken)


# The link


def test_a_peer_absent_at_start_is_told_of_and_found_when_it_comes():
    async def story() -> tuple[str, str, list[Sample]]:
        peer = await TcpPeer(Rig()).start()
        await peer.stop()
        async with live(peer) as source:
            down = await event(source, "link_down")
            await peer.start()
            up = await event(source, "link_up")
            taken = await samples(source, 1)
        await peer.stop()
        return down.text, up.text, taken

    down, up, taken = asyncio.run(story())
    assert "connection refused" in down
    assert "it answers again, after" in up
    assert taken[0].good


def test_an_outage_is_one_event_and_no_samples_and_the_return_is_another():
    async def story() -> list[str]:
        kinds: list[str] = []
        async with TcpPeer(Rig()) as peer, live(peer) as source:
            await samples(source, 5)
            await peer.stop()
            while isinstance(item := await within(anext(source)), Sample):
                pass  # those already read
            kinds.append(item.kind)
            silence = asyncio.ensure_future(anext(source))
            await asyncio.sleep(0.3)  # several attempts to connect
            assert not silence.done()
            await peer.start()
            kinds.append((await within(silence)).kind)
            await samples(source, 2)
        return kinds

    assert asyncio.run(story()) == ["link_down", "link_up"]


def test_one_dead_unit_of_three_costs_the_others_a_timeout_a_back_off_and_no_more():
    async def story() -> tuple[list[float], int, list[LinkEvent]]:
        rig = Rig()
        rig.silent = {2}
        async with TcpPeer(rig) as peer, live(peer, units=(1, 2, 3), options="&timeout=0.05") as source:
            down = await event(source, "link_down", "rig-2")
            while sum(request.unit == 2 for request in peer.requests) < 5:
                for sample in await samples(source, 20):
                    assert sample.valve in ("rig-1", "rig-3")
                    assert sample.good
            rig.silent = set()
            up = await event(source, "link_up", "rig-2")
            asked = [request for request in peer.requests if request.at <= up.time]
            return [one.at for one in asked if one.unit == 2], sum(one.unit != 2 for one in asked), [down, up]

    asked, n_others, (down, up) = asyncio.run(story())
    rests = [later - earlier for earlier, later in zip(asked, islice(asked, 1, None), strict=False)]
    for k, rest in enumerate(rests[:5]):
        assert rest >= 0.05 + min(0.1 * 2**k, 1.0) - 0.002  # its timeout, and the back-off
    assert n_others > 10 * len(asked)
    assert "no reply within 0.05 s" in down.text
    assert up.text.startswith("unit 2: it answers again")


def test_one_lost_reply_is_a_bad_sample_and_no_outage():
    async def story() -> list[str]:
        rig, n = Rig(), iter(range(10_000))
        seen: list[str] = []
        drop = lambda *asked: None if asked[3] == 4 and next(n) == 5 else rig(*asked)  # noqa: E731
        async with TcpPeer(drop) as peer, live(peer, options="&timeout=0.05") as source:
            while sum(text == "good" for text in seen) < 10:
                item = await within(anext(source))
                seen.append(item.kind if isinstance(item, LinkEvent) else "good" if item.good else "bad")
        return seen

    seen = asyncio.run(story())
    assert seen.count("bad") == 1
    assert "link_down" not in seen
    assert seen[seen.index("bad") - 1] == "bad_value"


def test_a_device_that_only_ever_answers_wrongly_is_down_and_the_reason_is_told():
    async def story(wrong: list[int]) -> LinkEvent:
        async with TcpPeer(lambda *request: wrong) as peer, live(peer) as source:
            return await event(source, "link_down")

    assert "the reply has 4 bytes, 10 are right for this request" in asyncio.run(story([1])).text


# Nothing ends in silence


class Dying:
    """A plan that reads for a while and then fails, as no plan should."""

    def __init__(self, plan: Polling, error: Exception | None) -> None:
        self._plan, self._error = plan, error
        self.signals, self.check = plan.signals, plan.check

    async def run(self, *work: object) -> None:
        reading = asyncio.create_task(self._plan.run(*work))
        await asyncio.sleep(0.1)
        reading.cancel()
        if self._error is not None:
            raise self._error


@pytest.mark.parametrize("error", [ZeroDivisionError("no such luck"), None])
def test_a_polling_task_that_dies_is_an_event_for_every_valve_and_an_error(error):
    async def story() -> tuple[list[str], BaseException]:
        async with TcpPeer(Rig()) as peer:
            address = parse_address(f"tcp://127.0.0.1:{peer.port}")
            async with LiveSource(address, valves_of(MAP, (1, 2)), Dying(Polling(None), error)) as source:
                downs = [(await event(source, "link_down")).valve for _ in range(2)]
                with pytest.raises(PollingStopped, match="the polling task ended") as death:
                    await samples(source, 1)
                return downs, death.value

    downs, death = asyncio.run(story())
    assert downs == ["rig-1", "rig-2"]
    assert death.__cause__ is error


def test_a_slow_reader_loses_nothing():
    async def story() -> list[float]:
        async with TcpPeer(Rig()) as peer, live(peer) as source:
            source._channel._backlog = 16
            first = await samples(source, 1)
            await asyncio.sleep(0.1)  # the polling has to wait
            return [sample["counter"].value for sample in first + await samples(source, 200)]

    counters = asyncio.run(story())
    assert counters == list(range(1, 202))


def test_who_waits_for_a_sample_is_let_go_when_the_source_is_left():
    async def story() -> list[object]:
        async with TcpPeer(lambda *request: None) as peer:
            source = live(peer)

            async def consume() -> list[object]:
                return [item async for item in source]

            async with source:
                waiting = asyncio.create_task(consume())
                await within(peer.asked.wait())
            return await within(waiting)

    assert asyncio.run(story()) == []


# Reads only


def test_nothing_is_written_unless_a_write_map_and_permission_are_given():
    setpoint = {"name": "setpoint", "table": "holding", "address": 7, "type": "int16", "scale": 0.1}
    run = {"name": "run", "table": "coil", "address": 0, "type": "bit"}
    write_map = WriteMap.model_validate({"kind": "write", "name": "rig-write", "points": [setpoint, run]})

    async def story(**options: object) -> list[tuple[int, int]]:
        async with TcpPeer(lambda *request: [] if request[1] in (15, 16) else words_of(1.0)) as peer:
            address = parse_address(f"tcp://127.0.0.1:{peer.port}")
            async with LiveSource(address, valves_of(MAP), Polling(50.0), **options) as source:
                await samples(source, 1)
                for name, value in (("setpoint", 40.0), ("run", 1.0)):
                    await source.write("rig", name, value)
            return [(request.function, request.address) for request in peer.requests if request.function > 4]

    with pytest.raises(BadInput, match="only reads"):
        asyncio.run(story())
    with pytest.raises(BadInput, match="only reads"):
        asyncio.run(story(write_map=write_map))
    with pytest.raises(BadInput, match="only reads"):
        asyncio.run(story(allow_write=True))
    assert asyncio.run(story(write_map=write_map, allow_write=True)) == [(16, 7), (15, 0)]


def test_a_write_that_the_device_refuses_or_the_map_forbids_is_said():
    write_map = WriteMap.model_validate(
        {"kind": "write", "name": "w", "points": [{"name": "sp", "table": "holding", "address": 7, "type": "int16"}]}
    )

    async def story(name: str, value: float, valve: str = "rig") -> None:
        async with TcpPeer(lambda *request: 3 if request[1] == 16 else words_of(1.0)) as peer:
            address = parse_address(f"tcp://127.0.0.1:{peer.port}")
            options = {"write_map": write_map, "allow_write": True}
            async with LiveSource(address, valves_of(MAP), Polling(50.0), **options) as source:
                await samples(source, 1)
                await source.write(valve, name, value)

    with pytest.raises(BadInput, match="no valve 'LC74'; there are rig"):
        asyncio.run(story("sp", 1.0, "LC74"))
    for name, value, words in (("sp", 1.0, "exception 3"), ("sp", 1e6, "cannot be sent"), ("kp", 1.0, "no point 'kp'")):
        with pytest.raises(BadInput, match=words):
            asyncio.run(story(name, value))


def test_a_write_that_nobody_confirms_is_a_trouble_of_the_link():
    points = [{"name": "sp", "table": "holding", "address": 7, "type": "int16"}]
    write_map = WriteMap.model_validate({"kind": "write", "name": "w", "points": points})

    def cut(frame: bytes) -> list[Send]:
        """The echo of a write without its last byte, in a frame that is right in itself."""
        reply = Frame.of_tcp(frame)
        return [Send(reply._replace(pdu=reply.pdu[:-1]).tcp() if reply.pdu[0] == 16 else frame)]

    async def story(answer: list[int] | int | None, harm: Callable[[bytes], list[Send]] | None = None) -> None:
        async with TcpPeer(lambda *request: answer if request[1] == 16 else words_of(1.0), harm) as peer:
            address = parse_address(f"tcp://127.0.0.1:{peer.port}?timeout=0.2")
            options = {"write_map": write_map, "allow_write": True}
            async with LiveSource(address, valves_of(MAP), Polling(50.0), **options) as source:
                await samples(source, 1)
                await source.write("rig", "sp", 1.0)

    with pytest.raises(LinkError, match="no reply within"):
        asyncio.run(story(None))
    with pytest.raises(LinkError, match="gateway target does not answer"):
        asyncio.run(story(11))
    with pytest.raises(ProtocolError, match="the reply has 4 bytes, 5 are right"):
        asyncio.run(story([], cut))
