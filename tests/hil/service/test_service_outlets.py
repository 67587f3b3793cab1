"""What leaves the service: events to files, programs and a broker, metrics and their rules, signs of life."""

from __future__ import annotations

import asyncio
import json
import re
import shutil
import socket
import struct
import subprocess
import sys
import threading
import tomllib
from pathlib import Path

import pytest
import yaml
from prometheus_client import generate_latest
from service_rig import plan_of, plant_file, until

from hil import BackOff, MonitorEvent, PlantFile, Service
from hil.service.outlets.json_lines import JsonLines
from hil.service.outlets.metrics import registry_of
from hil.service.outlets.mqtt import MqttSink
from hil.service.outlets.notify import Notifier
from hil.service.outlets.program import ProgramSink
from hil.service.outlets.sink import SinkTask
from hil.service.supervision import SupervisedTask
from recordings import BadInput

DEPLOY = Path(__file__).parents[3] / "deploy"
EVENTS = [MonitorEvent(float(k), 100.0 + k, "LC/74+20", "alarm", f"number {k}", "friction") for k in range(3)]


def test_json_lines_are_appended_whole_and_a_moved_file_begins_anew(tmp_path):
    sink, path = JsonLines(tmp_path / "events.jsonl"), tmp_path / "events.jsonl"
    sink.send(EVENTS[:2])
    path.rename(tmp_path / "old.jsonl")
    sink.send(EVENTS[2:])
    assert [json.loads(line)["text"] for line in path.read_text().splitlines()] == ["number 2"]
    assert len((tmp_path / "old.jsonl").read_text().splitlines()) == 2


def test_events_wait_for_a_sink_that_is_away_and_come_in_order():
    class Away:
        name = "away"

        def __init__(self) -> None:
            self.left, self.got = 2, []

        def send(self, events):
            if self.left:
                self.left -= 1
                raise ConnectionError("no route")
            self.got += events

        def close(self):
            pass

    async def story() -> None:
        sink = Away()
        task = SinkTask(sink)
        supervised = SupervisedTask("away", task.run, again=BackOff(0.01, 0.01))
        work = asyncio.create_task(supervised.run())
        for event in EVENTS:
            task.queue.put(event)
        await until(lambda: len(sink.got) == 3, "all events sent")
        assert sink.got == EVENTS
        assert supervised.status.restarts == 2
        assert "no route" in supervised.status.last_error
        work.cancel()
        task.close()

    asyncio.run(story())


def test_a_program_gets_each_event_on_its_standard_input_and_its_failure_is_only_logged(tmp_path, caplog):
    program = tmp_path / "tell"
    program.write_text(f"#!/bin/sh\ncat >> {tmp_path}/told\nexit 3\n")
    program.chmod(0o700)
    ProgramSink(program).send(EVENTS)
    assert [json.loads(line)["text"] for line in (tmp_path / "told").read_text().splitlines()][2] == "number 2"
    assert "exit status 3" in caplog.text


class Broker(threading.Thread):
    """The least of an MQTT 3.1.1 broker: CONNACK, PUBACK, and what was published."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.published: list[tuple[str, bytes]] = []

    def run(self) -> None:
        connection, _ = self.socket.accept()
        file = connection.makefile("rb")
        while head := file.read(1):
            size, shift = 0, 0
            while True:
                byte = file.read(1)[0]
                size, shift = size | (byte & 127) << shift, shift + 7
                if byte < 128:
                    break
            body = file.read(size)
            if head[0] >> 4 == 1:
                connection.sendall(b"\x20\x02\x00\x00")
            elif head[0] >> 4 == 3:
                (length,) = struct.unpack(">H", body[:2])
                self.published.append((body[2 : 2 + length].decode(), body[4 + length :]))
                connection.sendall(b"\x40\x02" + body[2 + length : 4 + length])


def test_events_reach_a_broker_under_the_valves_topic(tmp_path):
    broker = Broker()
    broker.start()
    more = f'[events.mqtt]\nhost = "127.0.0.1"\nport = {broker.port}\ntopic = "plant/7"\n'
    plant = PlantFile.read(plant_file(tmp_path, 1, more=more))
    sink = MqttSink(plant.events.mqtt, plant)
    sink.send(EVENTS)
    sink.close()
    assert [topic for topic, _ in broker.published] == ["plant/7/LC_74_20"] * 3
    assert json.loads(broker.published[2][1])["text"] == "number 2"


def test_a_broker_needs_the_extra(tmp_path, monkeypatch):
    for name in [one for one in sys.modules if one.split(".")[0] == "paho"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "paho", None)
    plant = PlantFile.read(plant_file(tmp_path, 1, more='[events.mqtt]\nhost = "127.0.0.1"\n'))
    with pytest.raises(BadInput, match="install Bristle with its extra 'mqtt', or leave it out"):
        MqttSink(plant.events.mqtt, plant)


def test_systemd_hears_when_it_is_ready_alive_and_stopping(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear:
        ear.bind(str(tmp_path / "notify"))
        told = Notifier({"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "30000000"})
        assert told.watchdog_s == 30.0
        told.ready("2 valves")
        told.alive("good")
        told.stopping()
        said = [ear.recv(200) for _ in range(3)]
    assert said == [b"READY=1\nSTATUS=2 valves", b"WATCHDOG=1\nSTATUS=good", b"STOPPING=1"]
    Notifier({}).alive("nobody asked")
    assert Notifier({"WATCHDOG_USEC": "1", "WATCHDOG_PID": "1"}).watchdog_s is None


@pytest.fixture(scope="module")
def exported(tmp_path_factory) -> str:
    async def made() -> Service:
        folder = tmp_path_factory.mktemp("metrics")
        return Service(plan_of(plant_file(folder, 1, 2, more='[recordings]\nfolder = "rec"\n')))

    return generate_latest(registry_of(asyncio.run(made()))).decode()


def names_of(exported: str) -> set[str]:
    """Every name under which something can be queried; a family without samples yet counts by its type."""
    names = set()
    for name, kind in re.findall(r"^# TYPE (\S+) (\S+)$", exported, re.MULTILINE):
        names.add(name if kind != "counter" or name.endswith("_total") else f"{name}_total")
    return names


def queried(expression: str) -> set[str]:
    return set(re.findall(r"\b(?:bristle|process)_[a-z0-9_]+", expression))


def test_every_rule_and_every_panel_asks_for_something_that_is_exported(exported):
    names = names_of(exported)
    rules = [rule for group in yaml.safe_load((DEPLOY / "alerts.yml").read_text())["groups"] for rule in group["rules"]]
    dashboard = json.loads((DEPLOY / "grafana-dashboard.json").read_text())
    targets = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    assert len(rules) >= 8
    assert len(targets) >= 15
    for expression in [rule["expr"] for rule in rules] + targets:
        assert queried(expression), expression
        assert queried(expression) <= names, expression
    assert {name for name in names if name.startswith("bristle_valve")} <= set().union(
        *map(queried, [*targets, *(rule["expr"] for rule in rules)]),
        {
            "bristle_valve_health",
            "bristle_valve_health_since_timestamp_seconds",
            "bristle_valve_observed_seconds_total",
        },
    )
    assert all(rule["annotations"]["summary"] and rule["labels"]["severity"] for rule in rules)


def test_what_is_not_known_is_absent_and_never_a_stale_number(exported):
    assert 'bristle_valve_health_level{valve="V1"} 3.0' in exported
    assert 'bristle_valve_health{state="check function",valve="V2"} 1.0' in exported
    assert 'bristle_valve_last_good_sample_age_seconds{valve="V1"} +Inf' in exported
    assert "bristle_valve_position_meters{" not in exported
    assert 'bristle_valve_samples_recorded_total{valve="V1"} 0.0' in exported


def test_the_unit_runs_without_root_and_with_a_watchdog_and_the_image_too():
    unit, image = (DEPLOY / "bristle.service").read_text(), (DEPLOY / "Containerfile").read_text()
    settings = dict(re.findall(r"^(\w+)=(.*)$", unit, re.MULTILINE))
    assert settings["Type"] == "notify"
    assert int(settings["WatchdogSec"]) >= 10
    assert settings["User"] == "bristle"
    assert settings["NoNewPrivileges"] == "yes"
    assert "monitor --plant" in settings["ExecStart"]
    assert re.findall(r"^USER (\d+)$", image, re.MULTILINE)[-1] != "0"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd-analyze")
def test_systemd_finds_nothing_wrong_with_the_unit(tmp_path):
    """The program stands elsewhere here, which is all that it may complain of; so its place is changed for the test."""
    unit = (DEPLOY / "bristle.service").read_text().replace("/opt/bristle/bin/bristle", sys.executable)
    (tmp_path / "bristle.service").write_text(unit)
    command = ["systemd-analyze", "verify", "--recursive-errors=no", "--man=no", str(tmp_path / "bristle.service")]
    checked = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert (checked.returncode, checked.stdout + checked.stderr) == (0, "")


def steps_of(image: str) -> list[tuple[str, str]]:
    """The instructions of a recipe, with continued lines joined."""
    joined = re.sub(r"\\\n\s*", " ", image)
    return [(one.split()[0], one.partition(" ")[2]) for one in joined.splitlines() if one and not one.startswith("#")]


def test_what_the_recipe_of_the_image_copies_and_installs_is_there():
    """No engine builds it here; what can be looked at without one is looked at."""
    root = DEPLOY.parent
    steps = steps_of((DEPLOY / "Containerfile").read_text())
    assert {word for word, _ in steps} <= {
        "FROM", "RUN", "WORKDIR", "COPY", "ENV", "USER", "VOLUME", "EXPOSE", "STOPSIGNAL", "HEALTHCHECK", "ENTRYPOINT",
        "CMD",
    }  # fmt: skip
    copied = [words.split() for word, words in steps if word == "COPY" and "--from" not in words]
    sources = [source for *some, _ in copied for source in some]
    assert all((root / source).exists() for source in sources), sources
    project = tomllib.loads((root / "pyproject.toml").read_text())
    packages = project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    assert set(packages) <= set(sources), "every package of the distribution is copied"
    needed = {project["project"]["readme"], *project["project"].get("license-files", [])}
    assert {"pyproject.toml", "constraints.txt", *needed} <= set(sources)
    (installed,) = [words for word, words in steps if word == "RUN" and "pip install" in words]
    extras = re.search(r'"\.\[([a-z,]+)\]"', installed)
    assert extras
    assert set(extras[1].split(",")) <= set(project["project"]["optional-dependencies"])
    assert json.loads(dict(steps)["ENTRYPOINT"]) == ["/opt/bristle/bin/bristle"]
    assert json.loads(dict(steps)["CMD"])[0] == "monitor"
