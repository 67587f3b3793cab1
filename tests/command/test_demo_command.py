"""`bristle demo`: the main job end to end, and that nothing of it is left running."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import urllib.request
from functools import partial

import pytest
from rich.console import Console

from bristle.cli.demo.trace import trace_stage
from bristle.cli.demo.watch import watch_stage
from bristle.cli.tracing import BUDGET_S
from identification import trace
from recordings import NegativeAnswer, bundled_path, read, read_truth
from simulator import BASE, CATALOGUE, Catalogue, ValveModel

PAGE = re.compile(r"http://127\.0\.0\.1:(\d+)/")
LISTENING = re.compile(r"tcp://127\.0\.0\.1:(\d+)")


NEAREST = ("flow_force", "position_dependent_friction", "position_periodic_force")
"""The effect that the demo is to trace, and those that come nearest to it."""


def ports(said: str) -> list[int]:
    """Of the served valves that were named."""
    return [int(port) for port in dict.fromkeys(LISTENING.findall(said))]


def refuses(port: int) -> bool:
    """Whether nothing listens there."""
    with socket.socket() as peer:
        peer.settimeout(5.0)
        return peer.connect_ex(("127.0.0.1", port)) != 0


@pytest.mark.parametrize(
    "tried",
    [pytest.param(NEAREST, marks=pytest.mark.slow), pytest.param(CATALOGUE.ids, marks=pytest.mark.long)],
    ids=["few", "all"],
)
def test_it_fits_records_traces_and_watches_and_leaves_nothing_running(console, tmp_path, monkeypatch, tried):
    """Whole but that few effects are tried: the whole catalogue takes minutes more.

    With few of them it is kept, looked at, and interrupted.
    """
    kept = Kept()
    monkeypatch.setattr("bristle.cli.demo.watch.watch_stage", kept.stage)
    few = Catalogue(tuple(CATALOGUE[effect] for effect in CATALOGUE.ids if effect in {*BASE, *tried}))
    monkeypatch.setattr("bristle.cli.demo.trace.trace", partial(trace, catalogue=few))
    out = tmp_path / "here"
    keep = ("--keep",) if tried is NEAREST else ()
    ending = console("demo", "--out", out, *keep)
    assert ending.code == 0, ending.err
    assert kept.answered == ([204] if keep else [])
    assert refuses(int(PAGE.findall(ending.out)[-1]))
    assert "truth" in ending.out
    assert "sparse regression agrees" in ending.out
    truth = read_truth(bundled_path("step"))
    for name, parameter in ValveModel.read(out / "model.json").parameters.items():
        assert abs(parameter.value - truth[name]) < 4.5 * parameter.std
        assert abs(parameter.value / truth[name] - 1) < 0.02
    for name in ("staircase", "sines", "held-out"):
        assert len(read(out / f"{name}.h5").time) >= 800
    found = json.loads((out / "trace.json").read_text())
    assert found["verdict"] == found["effects_added"][0] == "position_periodic_force"
    before, after = (found["error"][side]["report"]["rmse_m"] for side in ("before", "after"))
    assert after < before
    assert f"{1e3 * before:.3f} mm before, {1e3 * after:.3f} mm after" in ending.out
    added = ValveModel.read(out / "traced.json").values
    assert added["position_periodic_force.pitch"] == pytest.approx(6e-3, rel=0.05)
    kinds = [(event["kind"], event["fault"]) for event in map(json.loads, (out / "events.jsonl").open())]
    assert ("alarm", "friction") in kinds
    last = " ".join(ending.out[ending.out.index("report.html") :].split())
    assert "expect at most one false alarm in" in last
    said = ending.out[: ending.out.index("Now the friction")]
    assert "Alarm" not in said
    assert len(ports(ending.out)) == 2
    assert all(refuses(port) for port in ports(ending.out))
    for name in ("report.html", "trace.html"):
        assert (out / name).stat().st_size > 10_000
        assert name in ending.out


class Kept:
    """The last stage of a demo that is kept: the page is asked whether it is alive, and the demo interrupted."""

    def __init__(self) -> None:
        self.answered: list[int] = []

    def stage(self, model, out, say, ending, keep):
        def heard(text):
            say(text)
            if "stays at" in text:
                threading.Thread(target=self.look, args=(PAGE.findall(text)[0],)).start()

        watch_stage(model, out, heard, ending, keep)

    def look(self, port):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/alive", timeout=60.0) as answer:
            self.answered.append(answer.status)
        os.kill(os.getpid(), signal.SIGINT)


def test_its_trace_has_a_budget_of_time(tmp_path, monkeypatch):
    asked = {}

    def ask(recordings, **options):
        asked.update(options)
        raise NegativeAnswer("asked")

    monkeypatch.setattr("bristle.cli.demo.trace.trace", ask)
    with pytest.raises(NegativeAnswer, match="asked"):
        trace_stage([bundled_path(name) for name in ("step", "sine", "mixed")], tmp_path, Console())
    assert BUDGET_S <= asked["budget"] < math.inf


@pytest.mark.slow
def test_interrupted_it_ends_with_130_and_takes_the_served_valve_with_it(tmp_path):
    command = [sys.executable, "-u", "-m", "bristle", "demo", "--out", str(tmp_path / "here")]
    demo = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        line = next(line for line in demo.stdout if LISTENING.search(line))
        os.kill(demo.pid, signal.SIGINT)
        _, complaint = demo.communicate(timeout=60.0)
    finally:
        demo.kill()
        demo.wait()
    assert demo.returncode == 130
    assert complaint.splitlines()[-1] == "bristle: interrupted"
    assert refuses(ports(line)[0])


def test_a_folder_that_cannot_be_used_is_refused_before_any_work(console, tmp_path):
    (tmp_path / "file").write_text("")
    assert "cannot be made" in console.refused("demo", "--out", tmp_path / "file" / "here")
    assert "cannot be made" in console.refused("demo", "--out", tmp_path / "file")
    (tmp_path / "here" / "staircase.h5").mkdir(parents=True)
    assert "staircase.h5: it cannot be written" in console.refused("demo", "--out", tmp_path / "here")
