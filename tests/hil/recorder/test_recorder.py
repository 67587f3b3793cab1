"""The recorder: what a source says is in the files, what is not good is missing, and nothing is lost on the way."""

from __future__ import annotations

import asyncio
import shutil
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import h5py
import numpy as np
import pytest
from link_peers import TcpPeer, within
from link_rig import MAP, Rig

from hil import (
    LinkEvent,
    Polling,
    PollingStopped,
    Quality,
    Reading,
    Recorder,
    RecorderReport,
    RecorderSettings,
    Sample,
    Source,
    Statistics,
    open_source,
    valves_of,
)
from hil.recorder.notes import Note, Notes
from recordings import BadInput, Plant, SignalSpec, read

SPECS = (SignalSpec("time", "s", "time"), SignalSpec("position", "mm", "output"), SignalSpec("mode", "1", "extra"))


class Script:
    """A source that says what a list says, then ends, or waits, or fails."""

    def __init__(self, items: Sequence[Sample | LinkEvent | Exception], valves: Sequence[str] = ("V1",)) -> None:
        self.signals = dict.fromkeys(valves, SPECS)
        self.statistics = Statistics()
        self._items = iter(items)

    async def __aenter__(self) -> Script:
        return self

    async def __aexit__(self, *_: object) -> None:
        pass

    def __aiter__(self) -> Script:
        return self

    async def __anext__(self) -> Sample | LinkEvent:
        item = next(self._items, None)
        if item is None:
            raise StopAsyncIteration
        if isinstance(item, Exception):
            raise item
        return item


class Acknowledged:
    """What the disk has acknowledged, by file, for a loop to wait on."""

    def __init__(self) -> None:
        self.samples: dict[Path, int] = {}
        self._told: asyncio.Event | None = None

    def __call__(self, path: Path, n_samples: int) -> None:
        self.samples[path] = n_samples
        if self._told is not None:
            self._loop.call_soon_threadsafe(self._told.set)

    async def until(self, enough: Callable[[dict[Path, int]], bool]) -> None:
        self._loop, self._told = asyncio.get_running_loop(), self._told or asyncio.Event()
        while not enough(self.samples):
            self._told.clear()
            await self._told.wait()


class InStep(Script):
    """A source that goes on after some samples only when the disk has acknowledged all of them."""

    def __init__(self, n_samples: int, every: int, disk: Acknowledged) -> None:
        super().__init__([sample(k) for k in range(n_samples)])
        self.given, self.every, self.disk = 0, every, disk

    async def __anext__(self) -> Sample | LinkEvent:
        if self.given % self.every == 0:
            await self.disk.until(lambda samples: sum(samples.values()) == self.given)
        self.given += 1
        return await super().__anext__()


def sample(k: int, valve: str = "V1", position: Reading | None = None) -> Sample:
    time = 100.0 + 0.01 * k
    position = position or Reading(float(k), "mm", time=time - 0.002)
    readings = {"position": position, "mode": Reading(float(k % 3), "1", time=time + 0.003)}
    return Sample(100.0 + 0.01 * k, 1.7e9 + 0.01 * k, valve, readings)


def live(peer: TcpPeer, rate: float = 200.0) -> Source:
    return open_source(f"tcp://127.0.0.1:{peer.port}", valves_of(MAP), Polling(rate))


def recorded(source: Script, to: Path, **settings: object) -> RecorderReport:
    async def story() -> RecorderReport:
        return await within(Recorder(source, RecorderSettings(to, **settings)).run(asyncio.Event()))

    return asyncio.run(story())


def test_samples_become_a_recording_with_its_own_clock(tmp_path):
    plant = Plant(stroke_m=0.0381)
    report = recorded(
        Script([sample(k) for k in range(100)]), tmp_path / "run.h5", plant=plant, title="a run", kind="rig"
    )
    recording = read(tmp_path / "run.h5")
    assert recording.time == pytest.approx(0.01 * np.arange(100))
    assert recording["position"].values.tolist() == list(range(100))
    assert recording.reply_times["position"] - recording.time == pytest.approx(-0.002)
    assert recording.reply_times["mode"] - recording.time == pytest.approx(0.003)
    assert [recording[name].role for name in recording] == ["time", "output", "extra"]
    assert (recording.title, recording.source, recording.plant.tag) == ("a run", "rig", "V1")
    assert recording.plant.stroke_m == 0.0381
    assert recording.created is not None
    assert recording.created.timestamp() == pytest.approx(1.7e9)
    assert not list(tmp_path.glob("*.journal"))
    (one,) = report.valves
    assert (one.samples, one.bad, one.files) == (100, 0, (tmp_path / "run.h5",))
    assert one.rate == pytest.approx(100.0)


def test_times_do_not_depend_on_how_long_the_machine_has_been_up(tmp_path):
    for name, up in (("short", 3.7), ("long", 4.1e6 + 1 / 3)):
        ticks = [Sample(up + 0.0025 * k, 1.7e9, "V1", sample(k).readings) for k in range(50)]
        recorded(Script(ticks), tmp_path / f"{name}.h5")
    short, long = (read(tmp_path / f"{name}.h5").time for name in ("short", "long"))
    assert short.tolist() == long.tolist() == [round(0.0025 * k, 9) for k in range(50)]


def test_a_value_that_is_not_good_is_missing_and_the_event_says_why(tmp_path):
    bad = Reading(float("nan"), "mm", Quality.OUT_OF_RANGE, "77 outside 0 to 50 mm")
    stale = Reading(7.0, "mm", Quality.STALE, "the heartbeat stands still")
    why = LinkEvent(100.01, 1.7e9, "V1", "bad_value", "position: out of range: 77 outside 0 to 50 mm")
    report = recorded(Script([sample(0), why, sample(1, position=bad), sample(2, position=stale), sample(3)]), tmp_path)
    recording = read(report.valves[0].files[0])
    assert np.isnan(recording["position"].values).tolist() == [False, True, True, False]
    assert recording["mode"].values.tolist() == [0, 1, 2, 0]  # the other values of the sample stay
    assert [(event.time, event.kind) for event in recording.events] == [(pytest.approx(0.01), "bad_value")]
    assert report.valves[0].bad == 2
    assert recording.quality["position"].tolist() == [0, 2, 1, 0]  # codes of recordings.QUALITIES
    assert not recording.quality["mode"].any()


def test_a_note_of_who_watches_is_an_event_at_its_sample_even_after_the_last_one(tmp_path):
    notes = Notes()

    class Watched(Script):
        """Somebody notes the last sample when it has been given away already."""

        async def __anext__(self) -> Sample | LinkEvent:
            try:
                return await super().__anext__()
            except StopAsyncIteration:
                notes.add(Note(100.03, "V1", "alarm", "the friction has changed; test 'fc' at 2.5, limit 1"))
                raise

    recorded(Watched([sample(k) for k in range(4)]), tmp_path / "run.h5", notes=notes)
    (event,) = read(tmp_path / "run.h5").events
    assert (event.time, event.kind) == (pytest.approx(0.03), "alarm")
    assert event.text == "the friction has changed; test 'fc' at 2.5, limit 1"


def test_every_valve_has_its_own_file_and_events(tmp_path):
    items = [sample(k, valve) for k in range(10) for valve in ("A", "B")]
    down = LinkEvent(100.05, 1.7e9, "B", "link_down", "unit 2: no reply")
    report = recorded(Script([*items, down], ("A", "B")), tmp_path)
    first, second = (read(one.files[0]) for one in report.valves)
    assert (first.plant.tag, second.plant.tag) == ("A", "B")
    assert ([event.kind for event in first.events], [event.kind for event in second.events]) == ([], ["link_down"])
    assert len(first) == len(second) == 10


@pytest.mark.parametrize("rotation", [{"rotate_s": 0.1}, {"rotate_mb": 0.05}])
def test_rotation_loses_no_sample_and_the_clock_goes_on(tmp_path, rotation):
    async def story() -> RecorderReport:
        disk = Acknowledged()
        settings = RecorderSettings(tmp_path, batch_s=0.02, acknowledge=disk, **rotation)
        async with TcpPeer(Rig()) as peer:
            stop = asyncio.Event()
            async with live(peer, 500.0) as source:
                recorder = Recorder(source, settings)
                running = asyncio.create_task(recorder.run(stop))
                await within(disk.until(lambda samples: len(samples) >= 4))
                stop.set()
                return await within(running)

    (one,) = asyncio.run(story()).valves
    parts = [read(path) for path in one.files]
    assert len(parts) >= 4
    assert [part.attributes["part"] for part in parts] == list(range(1, len(parts) + 1))
    assert len({part.created for part in parts}) == 1
    counters = np.concatenate([part["counter"].values for part in parts])
    assert counters.tolist() == list(range(1, len(counters) + 1))
    assert (np.diff(np.concatenate([part.time for part in parts])) > 0).all()
    assert len(counters) == one.samples


def test_a_single_sample_is_no_recording(tmp_path):
    report = recorded(Script([sample(0)]), tmp_path)
    assert report.samples == 0
    assert not list(tmp_path.iterdir())


def test_what_is_acknowledged_is_in_the_file_at_that_moment(tmp_path):
    seen: list[tuple[int, int]] = []
    disk = Acknowledged()

    def acknowledge(path: Path, n_samples: int) -> None:
        shutil.copy(path, tmp_path / "copy.hdf5")  # what a killed process would leave
        with h5py.File(tmp_path / "copy.hdf5") as file:
            seen.append((n_samples, min(len(column) for column in file["signals"].values())))
        disk(path, n_samples)

    recorded(InStep(200, 50, disk), tmp_path / "run.h5", batch_s=0.02, acknowledge=acknowledge)
    assert len(seen) > 2
    assert all(n_samples == there for n_samples, there in seen)
    assert seen[-1][0] == 200


class Yielding(Script):
    """A source that lets others run before every item, so that it may end while a batch is on its way to the disk."""

    async def __anext__(self) -> Sample | LinkEvent:
        await asyncio.sleep(0)
        return await super().__anext__()


@pytest.mark.slow
def test_a_source_that_ends_while_a_batch_is_on_its_way_loses_none_of_it(tmp_path):
    for n_samples in range(2, 42):
        path = tmp_path / f"{n_samples}.h5"
        recorded(Yielding([sample(k) for k in range(n_samples)]), path, batch_s=0.0)
        assert len(read(path).time) == n_samples


def after_turns(n: int, call: Callable[[], None]) -> None:
    """Call something after so many turns of the loop."""
    asyncio.get_running_loop().call_soon(*((after_turns, n - 1, call) if n else (call,)))


def test_a_disk_that_refuses_a_batch_while_the_source_ends_is_heard(tmp_path):
    disk, ended = Acknowledged(), threading.Event()

    def refuse(path: Path, n_samples: int) -> None:
        refused = ended.is_set()
        disk(path, n_samples)
        ended.wait(10.0)
        if not refused:
            raise BadInput(str(path), "the disk is full", "make room")

    class Ending(Yielding):
        async def __anext__(self) -> Sample | LinkEvent:
            try:
                return await super().__anext__()
            except StopAsyncIteration:
                await disk.until(bool)  # a batch is on its way
                after_turns(20, ended.set)  # by then the recorder has seen the end
                raise

    with pytest.raises(BadInput, match="the disk is full"):
        recorded(Ending([sample(k) for k in range(20)]), tmp_path / "run.h5", batch_s=0.0, acknowledge=refuse)


def test_a_recording_can_be_recorded_again(tmp_path):
    recorded(Script([sample(k, position=Reading(float(k), "mm")) for k in range(50)]), tmp_path / "first.h5")

    async def story() -> RecorderReport:
        async with open_source(f"replay:{tmp_path / 'first.h5'}") as source:
            return await Recorder(source, RecorderSettings(tmp_path / "again.h5")).run(asyncio.Event())

    asyncio.run(story())
    first, again = read(tmp_path / "first.h5"), read(tmp_path / "again.h5")
    assert again.time == pytest.approx(first.time)
    assert all(np.array_equal(first[name].values, again[name].values) for name in ("position", "mode"))
    assert again.created == first.created


def test_a_source_that_dies_leaves_a_closed_recording(tmp_path):
    down = LinkEvent(100.3, 1.7e9, "V1", "link_down", "the polling task ended")
    items = [*(sample(k) for k in range(20)), down, PollingStopped("the polling task ended")]
    with pytest.raises(PollingStopped):
        recorded(Script(items), tmp_path / "run.h5")
    recording = read(tmp_path / "run.h5")
    assert len(recording) == 20
    assert [event.kind for event in recording.events] == ["link_down"]
    assert not list(tmp_path.glob("*.journal"))


def test_a_disk_that_refuses_ends_the_session_in_words(tmp_path):
    folder, disk = tmp_path / "runs", Acknowledged()

    class Vanishing(InStep):
        async def __anext__(self) -> Sample | LinkEvent:
            item = await super().__anext__()
            if item.time > 100.5:
                shutil.rmtree(folder, ignore_errors=True)
            return item

    with pytest.raises(BadInput, match="runs"):
        recorded(Vanishing(500, 10, disk), folder, batch_s=0.02, rotate_s=0.1, acknowledge=disk)


def test_whoever_cannot_be_told_does_not_end_the_recording_and_is_counted(tmp_path):
    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    why = LinkEvent(100.05, 1.7e9, "V1", "bad_value", "mode: not valid: nothing")
    source = Script([*(sample(k) for k in range(10)), why, *(sample(k) for k in range(10, 20))])
    report = recorded(source, tmp_path / "run.h5", tell=refuse, acknowledge=refuse)
    assert len(read(tmp_path / "run.h5")) == 20
    assert [event.kind for event in read(tmp_path / "run.h5").events] == ["bad_value"]
    assert report.statistics.failures["an event could not be told ([Errno 28] No space left on device)"] == 1
    assert report.statistics.failures["a batch could not be acknowledged ([Errno 28] No space left on device)"] >= 1


@pytest.mark.parametrize(
    ("make", "valves", "words"),
    [
        (lambda folder: (folder / "run.h5").touch() or folder / "run.h5", ["A"], "it exists already"),
        (lambda folder: folder / "run.h5", ["A", "B"], "it is one file, and there are 2 valves"),
        (lambda folder: (folder / "plain").touch() or folder / "plain" / "runs", ["A"], "nothing can be written there"),
        (lambda folder: Path("/proc/bristle"), ["A"], "nothing can be written there"),
    ],
)
def test_a_place_that_cannot_be_recorded_to_is_named_at_once(
    tmp_path, make: Callable[[Path], Path], valves: list[str], words: str
):
    with pytest.raises(BadInput, match=words):
        Recorder(Script([], valves), RecorderSettings(make(tmp_path)))
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".writable")]


def test_two_sessions_in_one_second_do_not_share_a_file(tmp_path):
    names = [recorded(Script([sample(k) for k in range(5)]), tmp_path).valves[0].files[0].name for _ in range(2)]
    assert names == ["V1-20231114T221320Z-001.h5", "V1-20231114T221320Z-002.h5"]


def test_a_recording_of_a_live_link_tells_of_its_outages(tmp_path):
    async def story() -> RecorderReport:
        peer = TcpPeer(Rig())
        async with peer, live(peer) as source:
            stop, disk = asyncio.Event(), Acknowledged()
            settings = RecorderSettings(tmp_path / "run.h5", batch_s=0.05, acknowledge=disk)
            running = asyncio.create_task(Recorder(source, settings).run(stop))
            await within(disk.until(lambda samples: sum(samples.values()) >= 50))
            peer.drop()
            await within(disk.until(lambda samples: sum(samples.values()) >= 100))
            stop.set()
            return await within(running)

    report = asyncio.run(story())
    recording = read(tmp_path / "run.h5")
    assert len(recording) == report.samples >= 100
    assert recording.time[0] == 0.0
    links = [event.kind for event in recording.events if event.kind.startswith("link")]
    assert links == ["link_up", "link_down", "link_up"]
    assert (np.diff(recording["counter"].values) >= 1).all()
    assert report.statistics.lateness.count == report.statistics.polls
