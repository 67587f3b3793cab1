"""`bristle replay` and the monitor without a wire: what they refuse, what they keep, and several valves at once."""

from __future__ import annotations

import asyncio
import hashlib
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest
from monitor_rig import broken_file

from bristle.cli.app import run
from detector import Measurements, Watch, learn
from hil import LinkEvent, Monitor, MonitorEvent, Reading, Sample, load_state, open_source, save_state
from recordings import BadInput, Recording, SignalSpec, read, write
from simulator import ValveModel


@pytest.mark.slow
def test_a_replay_tells_its_alarm_by_events_and_exit_code(model, healthy, tmp_path, capsys):
    broken, events = broken_file(healthy, tmp_path / "broken.h5"), tmp_path / "events.jsonl"
    known = ["--model", str(model), "--calibrate", str(healthy)]
    assert run(["replay", str(healthy), *known]) == 0
    assert capsys.readouterr().out == ""
    assert run(["replay", str(broken), *known, "--events", str(events), "--valve", "LC74_20"]) == 1
    assert "alarms raised: " in capsys.readouterr().err
    first = json.loads(events.read_text().splitlines()[0])
    assert list(first) == ["time", "t_s", "valve", "kind", "fault", "residual", "threshold", "text"]
    assert (first["valve"], first["kind"]) == ("LC74_20", "alarm")
    start = float(read(broken).time[0])
    assert 30.0 < first["t_s"] - start < 32.0
    assert first["residual"] > first["threshold"]


@pytest.mark.slow
def test_what_was_learned_is_saved_and_resumed_and_belongs_to_its_model(model, healthy, tmp_path, capsys):
    state = tmp_path / "state.json"
    command = ["replay", str(healthy), "--model", str(model), "--state", str(state)]
    assert run([*command, "--learn", "30"]) == 0
    kept = json.loads(state.read_text())
    assert kept["format"] == "monitor-state"
    assert run(command) == 0
    taken_up = capsys.readouterr().err
    assert "resumed from" in taken_up
    assert re.search(r"false alarms: [\d.]+ s fault-free", taken_up)  # what it watches by is said
    assert not list(tmp_path.glob("*.part"))
    other = tmp_path / "other.json"
    changed = json.loads(model.read_text())
    changed["parameters"]["lugre.fc"]["value"] = 99.0
    other.write_text(json.dumps(changed))
    assert run(["replay", str(healthy), "--model", str(other), "--state", str(state)]) == 2
    assert "another model" in capsys.readouterr().err


def state_text(valves: object) -> str:
    """A state file with a checksum that is right."""
    checksum = hashlib.sha256(json.dumps(valves, sort_keys=True).encode()).hexdigest()
    about = {"format": "monitor-state", "version": 3, "model": "m", "sha256": checksum, "valves": valves}
    return json.dumps(about)


def changed(parts: object, new: float) -> Iterator[object]:
    """The same content with one number after the other replaced."""
    inside = parts.items() if isinstance(parts, dict) else enumerate(parts) if isinstance(parts, list) else ()
    for key, one in inside:
        for other in [new] if isinstance(one, float) else changed(one, new):
            copy = parts.copy()
            copy[key] = other
            yield copy


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "cannot be read"),
        ('{"format": "valve-model"}', "no monitor-state"),
        ('{"format": "monitor-state", "version": 2, "model": "m", "valves": {}}', "version 2.* learn anew"),
        (state_text([]), "names no valves"),
        (state_text({"A": {}}), "A"),
        (state_text({"A": {"watch": {}}}), "learn anew"),
        (state_text({"A": {"watch": {}}}).replace("watch", "match"), "checksum"),
        (state_text({}).replace('3, "model"', '4, "model"'), "it is of version 4"),
        ("[" * 100_000, "cannot be read"),
        ("9" * 10_000, "cannot be read"),
    ],
)
def test_a_state_file_that_cannot_be_used_is_refused_in_words(text, words, tmp_path):
    path = tmp_path / "state.json"
    path.write_text(text)
    with pytest.raises(BadInput, match=words):
        load_state(path, "m")


def test_events_on_a_full_disk_do_not_end_the_watching(model, healthy, tmp_path, capsys):
    broken = broken_file(healthy, tmp_path / "broken.h5")
    known = ["--model", str(model), "--calibrate", str(healthy)]
    assert run(["replay", str(broken), *known, "--events", "/dev/full"]) == 1
    errors = capsys.readouterr().err
    samples = len(read(broken))
    assert f"{samples} samples in" in errors
    assert "could not be written" in errors
    assert "No space left" in errors
    assert "alarms raised: " in errors


@pytest.mark.slow
def test_what_fails_is_said_when_it_happens_and_not_at_the_end_alone(model, healthy, tmp_path, capsys):
    broken = broken_file(healthy, tmp_path / "broken.h5")
    known = ["--model", str(model), "--calibrate", str(healthy), "--events", "/dev/full"]
    assert run(["replay", str(broken), *known, "--pace", "20"]) == 1
    first, last = re.findall(r"^.*No space left.*$", capsys.readouterr().err, re.MULTILINE)
    assert first.endswith("; the watching goes on")
    assert re.match(r"\d+ x an event could not be written", last)


def test_a_replay_without_anything_learned_or_with_too_little_is_refused(model, healthy, tmp_path, capsys):
    assert run(["replay", str(healthy), "--model", str(model)]) == 2
    assert "--learn" in capsys.readouterr().err
    assert run(["replay", str(healthy), "--model", str(model), "--learn", "1000"]) == 1
    assert re.search(r"\(\d\d of 8 reversals, 48 s\) was still learning", capsys.readouterr().err)
    assert run(["replay", str(tmp_path / "none.h5"), "--model", str(model), "--learn", "30"]) == 2
    assert run(["replay", str(healthy), "--model", str(tmp_path / "none.json"), "--learn", "30"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all("none." in line for line in lines)


def test_learning_goes_on_until_the_valve_has_moved_to_and_fro_often_enough(model, healthy, capsys):
    assert run(["replay", str(healthy), "--model", str(model), "--learn", "5"]) == 0
    learned = re.search(r"false alarms: ([\d.]+) s fault-free", capsys.readouterr().err)
    assert learned
    assert 5.0 < float(learned[1]) < 40.0


def test_signals_that_were_learned_with_and_do_not_come_are_named(model, healthy, tmp_path, capsys):
    recording = read(healthy)
    few = [one for one in recording.signals.values() if one.name not in ("pressure", "drive")]
    write(tmp_path / "few.h5", Recording.of(few, plant=recording.plant))
    command = ["replay", str(tmp_path / "few.h5"), "--model", str(model)]
    assert run([*command, "--calibrate", str(healthy)]) == 2
    assert "learned with drive and pressure" in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize(("place", "words"), [("", "it is a directory"), ("none/state.json", "nothing can be written")])
def test_a_state_that_cannot_be_saved_is_refused_before_anything_is_learned(
    place, words, model, healthy, tmp_path, capsys
):
    command = ["replay", str(healthy), "--model", str(model), "--learn", "30", "--state", str(tmp_path / place)]
    assert run(command) == 2
    complaint = capsys.readouterr().err.splitlines()
    assert len(complaint) == 1  # what is learned is told, and nothing was
    assert words in complaint[0]


def taken(monitor: Monitor, items: list[Sample | LinkEvent]) -> list[MonitorEvent]:
    async def story() -> list[MonitorEvent]:
        events = [await monitor.take(item) for item in items]
        return [event for event in events if event is not None]

    return asyncio.run(story())


def played(path: Path, name: str) -> list[Sample | LinkEvent]:
    async def story() -> list[Sample | LinkEvent]:
        async with open_source(f"replay:{path}", name=name) as source:
            return [item async for item in source]

    return asyncio.run(story())


@pytest.fixture(scope="module")
def learner(model):
    return lambda data: learn(data, ValveModel.read(model), 10.0)


@pytest.mark.parametrize("stride", [997, pytest.param(29, marks=pytest.mark.slow)])
def test_several_valves_are_judged_each_by_its_own_and_link_events_are_passed_on(healthy, learner, tmp_path, stride):
    good, bad = played(healthy, "A"), played(broken_file(healthy, tmp_path / "broken.h5"), "B")
    down = LinkEvent(good[200].time, good[200].wall, "A", "link_down", "closed by the peer")
    both = sorted([*good, *bad, down], key=lambda item: item.time)
    signals = {name: read(healthy).header.signals for name in ("A", "B")}
    learned: list[str] = []
    monitor = Monitor(signals, learner, 25.0, own_clock=True, on_learned=lambda valve, _: learned.append(valve))
    events = taken(monitor, both)
    assert learned == ["A", "B"]
    assert [(event.valve, event.kind) for event in events[:2]] == [("A", "link_down"), ("B", "alarm")]
    assert {event.valve for event in events if event.kind == "alarm"} == {"B"}
    assert monitor.alarms >= 1
    status = {one.valve: one for one in monitor.status}
    assert (status["A"].phase, status["A"].samples) == ("watching", len(good))
    save_state(tmp_path / "state.json", list(monitor.valves.values()), "m")
    known = load_state(tmp_path / "state.json", "m")
    check_that_no_number_can_blind_it(tmp_path / "state.json", stride)
    assert {name: isinstance(watch, Watch) for name, (watch, _) in known.items()} == {"A": True, "B": True}


def test_a_valve_that_comes_too_seldom_is_told_once_and_with_its_count_when_that_is_over(healthy, learner):
    played_once = [item for item in played(healthy, "A") if isinstance(item, Sample)]
    learned, later = played_once[:1300], played_once[1300:]
    at, items = learned[-1].time, list(learned)
    for k, item in enumerate((later * 4)[:1740]):
        at += 1.0 if k < 40 else 0.02  # one a second instead of fifty, and then as usual
        items.append(replace(item, time=at, wall=at))
    monitor = Monitor({"A": read(healthy).header.signals}, learner, 25.0, own_clock=True)
    gaps = [event for event in taken(monitor, items) if event.kind == "gap"]
    assert [gap.text for gap in gaps] == [
        "no usable sample for 1 s; the detector starts its errors anew",
        "samples come without gaps again; there were 40 in 39.0 s",
    ]
    assert 29.9 < gaps[1].t_s - (learned[-1].time + 40.0) < 30.2


def test_a_link_that_comes_and_goes_is_told_as_lost_until_it_holds(healthy, learner):
    first = next(item for item in played(healthy, "A") if isinstance(item, Sample))
    at, items = first.time, [first]
    for k in range(100):  # five seconds there, three not
        for kind in ("link_down", "link_up"):
            at += 3.0
            items.append(LinkEvent(at, at, "A", kind, f"the {k + 1}. time"))
        items += [replace(first, time=at + 0.5 * n, wall=at) for n in range(1, 5)]
    items += [replace(first, time=at + 10.0 + k, wall=at) for k in range(60)]
    events = taken(Monitor({"A": read(healthy).header.signals}, learner, 1e6, own_clock=True), items)
    assert [(event.kind, event.text) for event in events] == [
        ("link_down", "the 1. time"), ("link_up", "the 1. time"), ("link_down", "the 2. time"),
        ("link_up", "it holds again, after 100 losses in 594.0 s"),
    ]  # fmt: skip


def test_a_valve_that_cannot_be_learned_is_named_and_so_is_one_without_a_position(healthy, learner):
    def refusing(_: Measurements) -> Watch:
        raise BadInput("position", "it says nothing", "measure another")

    monitor = Monitor({"A": read(healthy).header.signals}, refusing, 5.0, own_clock=True)
    with pytest.raises(BadInput, match="valve A"):
        taken(monitor, played(healthy, "A"))
    with pytest.raises(BadInput, match="position"):
        Monitor({"A": (SignalSpec("time", "s", "time"), SignalSpec("flow", "m3/h", "output"))}, learner)


def test_a_position_in_percent_needs_the_stroke_and_bad_values_are_missing(healthy, learner):
    specs = (
        SignalSpec("time", "s", "time"),
        SignalSpec("position", "%", "output"),
        SignalSpec("setpoint", "%", "input"),
    )
    with pytest.raises(BadInput, match="stroke"):
        Monitor({"A": specs}, learner)
    monitor = Monitor({"A": specs}, learner, 25.0, stroke_m=0.04)
    sample = Sample(5.0, 1e9, "A", {"position": Reading(50.0, "%"), "setpoint": Reading(25.0, "%")})
    assert taken(monitor, [sample]) == []
    assert monitor.status[0].phase == "learning"


def check_that_no_number_can_blind_it(path: Path, stride: int) -> None:
    """A number that no valve has is refused wherever it stands, also with a checksum that is right."""
    valves, n_changed = json.loads(path.read_text())["valves"], 0
    for new in (float("nan"), float("inf"), 1e308, -1e300):
        for content in islice(changed(valves, new), 0, None, stride):
            path.write_text(state_text(content))
            n_changed += 1
            with pytest.raises(BadInput, match="not finite"):
                load_state(path, "m")
    assert n_changed > 20


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["plant.toml", "--record", "rec"], "--record"),
        (["--plant", "plant.toml", "--map", "damadics"], "--map"),
        (["--source", "tcp://127.0.0.1:1", "--model", "model.json", "--metrics", "127.0.0.1:0"], "--metrics"),
    ],
)
def test_an_option_that_would_do_nothing_is_refused(words, option, capsys):
    assert run(["monitor", *words]) == 2
    assert f"{option}: it does nothing here" in capsys.readouterr().err


@pytest.mark.slow
def test_a_replay_writes_a_report_that_says_what_to_do(model, healthy, tmp_path):
    broken, page = broken_file(healthy, tmp_path / "broken.h5"), tmp_path / "report.html"
    words = ["replay", str(broken), "--model", str(model), "--calibrate", str(healthy)]
    assert run([*words, "--events", str(tmp_path / "events.jsonl"), "--report", str(page)]) == 1
    said = page.read_text()
    opening = said[said.index("class='opening'") :]
    assert opening.index("Verdict:") < opening.index("Confidence:") < opening.index("Next:")
    assert "false alarms:" in opening
    assert said.count("<td>alarm</td>") >= 1


def test_a_report_that_cannot_be_written_is_refused_before_anything_is_watched(model, healthy, tmp_path, capsys):
    events = tmp_path / "events.jsonl"
    words = ["replay", str(healthy), "--model", str(model), "--calibrate", str(healthy), "--events", str(events)]
    assert run([*words, "--report", str(tmp_path / "nowhere" / "page.html")]) == 2
    assert "there is no folder" in capsys.readouterr().err
    assert not events.exists()
