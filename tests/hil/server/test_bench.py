"""A simulated valve in the hands of a test: time, faults, orders, the line, its recording, and the control port."""

from __future__ import annotations

import json
import socket
from contextlib import suppress

import numpy as np
import pytest

from hil import ActuatorPlant, ActuatorSetup, RegisterMap, ServerSettings, WriteMap, listen_address
from hil.testing import HARMS, Bench, ControlPort, NotReached, SimulatedValve
from recordings import BadInput, LinkError, drawn, read
from simulator.damadics import run_scenario, scenario


def settings(listen="tcp://127.0.0.1:0", speed=None):
    maps = RegisterMap.load("damadics"), WriteMap.load("damadics-write")
    return ServerSettings([listen_address(listen)], *maps, speed, harm=True)


def valve(listen="tcp://127.0.0.1:0", speed=None, **setup):
    return SimulatedValve(ActuatorPlant(ActuatorSetup(**setup)), settings(listen, speed))


def test_its_recording_is_the_simulation_sample_by_sample():
    what = scenario("chapter5-f11")
    with valve(stimulus=what.stimulus, faults=what.faults, noise=True, seed=3) as made:
        made.advance(1.0)
        made.advance(9.0)
        seen = made.recording()
    expected, _ = run_scenario("chapter5-f11", "play", True, 3, duration=10.0)
    assert np.array_equal(seen.time, expected.time)
    for name in ("position", "pressure", "mass_flow"):
        assert np.array_equal(seen[name].values, expected[name].values), name


def test_faults_and_orders_come_at_their_time_and_are_events():
    with valve() as made:
        made.advance(1.0)
        made.inject("f13", 0.5, at=2.0, until=3.0)
        made.order("setpoint", 0.1, at=2.5)
        made.order("fault_strength", 0.25)
        made.advance(1.5)
        recording = made.recording()
        assert [event.kind for event in made.events()] == ["injected", "order", "fault"]
        made.advance(1.0)
        assert [event.kind for event in made.events()][3:] == ["fault_end"]
        later = made.recording()
    active, setpoint = recording["fault_active"].values, later["setpoint"].values
    assert recording.time[np.flatnonzero(active)[0]] == 2.0
    assert later.time[np.flatnonzero(setpoint == 0.1)[0]] == 2.5
    assert later["fault_active"].values[-1] == 0.0


def test_faults_come_on_top_of_one_another():
    with valve() as made:
        made.order("setpoint", 1.0)
        made.advance(30.0)
        closed = made.now["mass_flow"]
        made.inject(18, 0.2)
        made.advance(1.0)
        leaking = made.now["mass_flow"]
        made.inject(19, 0.5, direction=1)
        made.advance(1.0)
        assert closed < 1.0 < leaking
        assert made.now["mass_flow"] == pytest.approx(0.5 * leaking, rel=1e-3)


def test_a_reset_begins_the_recording_anew():
    with valve() as made, made.connect() as device:
        made.advance(1.0)
        device.write("reset", 1)
        device.write("advance", 100)
        recording = made.recording()
    assert (recording.time[0], recording.time[-1], len(recording)) == (0.0, 0.25, 101)


def test_it_is_waited_for_in_plant_time():
    with valve() as made:
        when = made.wait_until(lambda now: now["position"] > 0.01)
        assert when == made.now["plant_time"]
        assert 0.0100 < made.now["position"] < 0.0102
        with pytest.raises(NotReached, match=r"not within 0\.5 s of plant time; at last .*position = 0\.01"):
            made.wait_until(lambda now: now["position"] > 1.0, within=0.5)
        assert made.now["plant_time"] == pytest.approx(when + 0.5)


def test_time_that_follows_the_clock_is_waited_for():
    with valve(speed=200.0) as made:
        made.advance(2.0)
        assert made.now["plant_time"] >= 2.0


@pytest.mark.parametrize("listen", ["tcp://127.0.0.1:0", "pty:"])
def test_nothing_passes_over_a_line_that_is_cut_until_it_is_healed(listen):
    with valve(listen) as made, made.connect(timeout=0.2) as device:
        device.write("setpoint", 0.25)
        made.harm("lost")
        with pytest.raises(LinkError):
            device.write("setpoint", 0.75)
        with pytest.raises(LinkError):
            device.read("position")
        made.advance(0.1)
        assert made.now["setpoint"] == 0.25
        made.heal()
        device.write("setpoint", 0.5)
        made.advance(0.1)
        assert made.now["setpoint"] == device.read("setpoint") == 0.5
        assert [event.kind for event in made.events()] == ["harm", "heal"]


def test_a_share_of_the_replies_is_harmed_the_same_way_every_time():
    def answered(seed):
        with valve() as made, made.connect(timeout=1.0) as device:
            device.read("position")
            made.harm("exception", 0.5, seed=seed)
            return [_answers(device) for _ in range(12)]

    first = answered(1)
    assert answered(1) == first
    assert set(first) == {True, False}


def _answers(device):
    try:
        device.read("sample_counter")
    except (BadInput, LinkError):
        return False
    return True


@pytest.mark.parametrize(
    ("do", "words"),
    [
        (lambda made: made.inject(20), "fault 20: there is no such fault; there are f1 valve clogging"),
        (lambda made: made.inject("friction"), "fault friction: there is no such fault"),
        (lambda made: made.inject(4, 2.0), "a strength is 0 to 1"),
        (lambda made: made.order("set_point", 0.5), "order set_point: there is no such setting; there are setpoint"),
        (lambda made: made.harm("fire"), f"there is no such harm; there are {', '.join(HARMS)}"),
        (lambda made: made.harm("drop", delay=3.0), "harm delay: it is not known of a harm; there are delay_s"),
        (lambda made: made.harm("drop", 1.5), "at most 1"),
        (lambda made: made.advance(-1.0), "so much time cannot go by"),
        (lambda made: made.recording(), "there are 1 samples"),
    ],
)
def test_what_cannot_be_is_refused_in_words(do, words):
    with valve() as made, pytest.raises(BadInput) as refused:
        do(made)
    assert words in str(refused.value)


def test_a_line_without_an_injector_cannot_be_harmed(tmp_path):
    with valve(f"pty:{tmp_path}/line") as made, pytest.raises(BadInput, match=r"the line rtu:.* cannot be harmed"):
        made.harm("drop")


def test_a_recording_is_drawn_with_its_events_and_gaps():
    with valve() as made:
        made.inject(4, 1.0, at=0.5)
        made.advance(1.0)
        picture = drawn(made.recording())
    assert picture.count("<polyline") == 11
    assert "f4 friction of valve or bushing" in picture


class Client:
    """Somebody at the control port."""

    def __init__(self, address):
        host, port = address.rsplit(":", 1)
        self._socket = socket.create_connection((host, int(port)), 10.0)
        self._file = self._socket.makefile("rw")

    def ask(self, line=None, **request):
        self._file.write((line or json.dumps(request)) + "\n")
        self._file.flush()
        answer = self._file.readline()
        return json.loads(answer) if answer else None

    def close(self):
        self._file.close()
        self._socket.close()


@pytest.fixture
def controlled():
    """A control port over two valves in lock-step; gives its address, its token, and what stop has done."""
    from hil.running import LoopThread

    stopped = []
    thread = LoopThread("bristle test")
    bench = Bench({unit: ActuatorPlant(ActuatorSetup()) for unit in (1, 2)}, settings())
    thread.run(bench.__aenter__())
    port = ControlPort(bench, lambda: stopped.append(True))
    thread.run(port.__aenter__())
    yield port.address, port.token, stopped
    thread.run(port.__aexit__(None, None, None))
    thread.run(bench.__aexit__(None, None, None))
    thread.close()


def test_the_control_port_does_what_a_test_can_do(controlled, tmp_path):
    address, token, stopped = controlled
    client = Client(address)
    assert client.ask(do="hello", token=token)["signals"]["plant_time"] == 0.0
    assert client.ask(do="inject", fault=4, strength=0.5, at=1.0, unit=2)["unit"] == 2
    assert client.ask(do="order", set={"setpoint": 0.25})["ok"]
    assert client.ask(do="harm", kind="delay", share=0.5, how={"delay_s": 0.01})["ok"]
    assert client.ask(do="heal")["ok"]
    assert client.ask(do="advance", seconds=2.0)["signals"]["plant_time"] == 2.0
    assert client.ask(do="signals", unit=2)["signals"]["plant_time"] == 2.0
    told = client.ask(do="events", unit=2)["events"]
    assert [one["kind"] for one in told] == ["injected", "harm", "heal", "fault"]
    assert client.ask(do="recording", to=str(tmp_path / "x.h5"))["samples"] == 801
    assert client.ask(do="recording", to=str(tmp_path / "x.svg"))["ok"]
    assert len(read(tmp_path / "x.h5")) == 801
    assert (tmp_path / "x.svg").read_text().startswith("<svg")
    assert client.ask(do="stop") == {"ok": True}
    assert stopped == [True]
    client.close()


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ({"do": "advance", "seconds": "long"}, "advance.seconds: Input should be a valid number"),
        ({"do": "advance", "seconds": 1e9}, "so much time cannot go by"),
        ({"do": "inject", "fault": 4, "force": 3}, "inject.force: Extra inputs are not permitted"),
        ({"do": "inject", "fault": 77}, "there is no such fault"),
        ({"do": "order", "set": {"setpoint": 0.5}, "unit": 9}, "unit 9: there is no such valve; there are 1, 2"),
        ({"do": "recording", "to": "/nowhere/x.h5"}, "/nowhere"),
        ({"do": "explode"}, "does not match any of the expected tags"),
    ],
)
def test_the_control_port_says_what_is_wrong_and_goes_on(controlled, request_, words):
    address, token, _ = controlled
    client = Client(address)
    client.ask(do="hello", token=token)
    client.ask(do="advance", seconds=0.1)
    answer = client.ask(**request_)
    assert not answer["ok"]
    assert words in answer["error"]
    assert not client.ask("no JSON")["ok"]
    assert client.ask(do="signals")["ok"]
    client.close()


@pytest.mark.parametrize(
    "first", ['{"do": "hello", "token": "guess"}', '{"do": "stop"}', "GET / HTTP/1.1", "[" * 9999, "x" * 100_000]
)
def test_who_does_not_know_the_token_is_dropped(controlled, first):
    address, token, stopped = controlled
    client = Client(address)
    with suppress(ConnectionError):  # dropped while it was still writing
        assert client.ask(first) is None
    assert stopped == []
    other = Client(address)
    assert other.ask(do="hello", token=token)["ok"]
    other.close()
