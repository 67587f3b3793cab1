"""A server and a recorder beside a synchronous program: they start, work, stop, and tell what went wrong."""

from __future__ import annotations

import socket
import threading

import pytest
from served_ramp import SPAN, Ramp, port_of, raw_map, settings
from test_recorder import Script, sample

from hil import BackgroundRecorder, BackgroundServer, Polling, PollingStopped, RecorderSettings, open_source, valves_of
from recordings import BadInput, read


class Acknowledged:
    """Counts the samples that are safe; a test waits until there are enough of them."""

    def __init__(self, wanted: int) -> None:
        self._wanted, self._enough = wanted, threading.Event()

    def __call__(self, _path, n_samples) -> None:
        if n_samples >= self._wanted:
            self._enough.set()

    def wait(self) -> None:
        assert self._enough.wait(20.0)


class Broken(Ramp):
    """A plant that cannot go on, once it runs."""

    def __init__(self) -> None:
        super().__init__()
        self.tried = threading.Event()

    def advance(self, n_steps):
        self.tried.set()
        raise ArithmeticError("the plant fell apart")


def ramp(address: str):
    """A source that polls the ramp behind an address."""
    return open_source(address, valves_of(raw_map()), Polling(100.0))


def threads() -> list[str]:
    return [one.name for one in threading.enumerate() if one.name.startswith("bristle")]


def test_a_server_is_recorded_in_one_program(tmp_path):
    enough = Acknowledged(20)
    where = RecorderSettings(tmp_path / "ramp.h5", batch_s=0.05, acknowledge=enough)
    with BackgroundServer({1: Ramp()}, settings()) as served:
        assert served.address == served.addresses[0]
        with BackgroundRecorder(ramp(served.address), where) as recorder:
            enough.wait()
            assert not recorder.wait(0.0)
    assert recorder.wait(0.0)
    assert recorder.report.valves[0].files == (tmp_path / "ramp.h5",)
    position = read(tmp_path / "ramp.h5")["position"].values * SPAN
    assert len(position) == recorder.report.samples >= 20
    assert (position[1:] >= position[:-1]).all()
    assert position[-1] > position[0]
    assert served.reports()[1].samples > 0
    assert threads() == []


def test_a_server_that_is_left_listens_no_more_and_can_be_served_again():
    with BackgroundServer({1: Ramp()}, settings()) as served:
        port = port_of(served.address)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), 1.0)
    with BackgroundServer({1: Ramp()}, settings(f"tcp://127.0.0.1:{port}")) as served:
        assert port_of(served.address) == port


def test_an_address_that_is_in_use_is_said_at_once():
    with BackgroundServer({1: Ramp()}, settings()) as served:
        again = settings(served.address)
        with pytest.raises(BadInput, match="the port is in use"), BackgroundServer({1: Ramp()}, again):
            pass
    assert threads() == []


def test_what_stops_plant_time_is_raised_when_the_server_is_left():
    plant = Broken()
    with pytest.raises(ArithmeticError, match="fell apart"), BackgroundServer({1: plant}, settings()):
        assert plant.tried.wait(20.0)
    assert threads() == []


def fail_beside_a_broken_plant():
    plant = Broken()
    with BackgroundServer({1: plant}, settings()):
        assert plant.tried.wait(20.0)
        raise KeyError("mine")


def test_what_goes_wrong_in_the_block_comes_before_what_stopped_the_plant():
    with pytest.raises(KeyError, match="mine"):
        fail_beside_a_broken_plant()


def test_a_recording_ends_with_its_source(tmp_path):
    source = Script([sample(k) for k in range(10)])
    with BackgroundRecorder(source, RecorderSettings(tmp_path / "x.h5")) as recorder:
        assert recorder.wait(20.0)
        assert recorder.report.samples == 10
    assert len(read(tmp_path / "x.h5").time) == 10


def test_a_recording_ends_with_its_duration(tmp_path):
    with BackgroundServer({1: Ramp()}, settings()) as served:
        where = RecorderSettings(tmp_path / "ramp.h5")
        with BackgroundRecorder(ramp(served.address), where, duration_s=0.3) as recorder:
            assert recorder.wait(20.0)
    assert recorder.report.samples == len(read(tmp_path / "ramp.h5").time)


def test_what_ends_a_recording_too_early_is_raised_and_what_came_before_is_kept(tmp_path):
    source = Script([*(sample(k) for k in range(10)), PollingStopped("the polling task ended")])
    where = RecorderSettings(tmp_path / "x.h5")
    with pytest.raises(PollingStopped, match="polling task"), BackgroundRecorder(source, where) as recorder:
        assert recorder.wait(20.0)
    assert len(read(tmp_path / "x.h5").time) == 10
    assert threads() == []


def test_what_cannot_be_recorded_is_said_before_it_begins(tmp_path):
    (tmp_path / "x.h5").touch()
    with pytest.raises(BadInput, match="exists already"):
        BackgroundRecorder(Script([]), RecorderSettings(tmp_path / "x.h5"))
