"""All of it with real parts: a served valve, the monitor of a plant, its page in a browser, a fault by register."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import sys
import time
import urllib.request
from asyncio.subprocess import PIPE
from itertools import groupby
from pathlib import Path

import pytest
from monitor_rig import RATE, MonitorProcess, Served, moved, serve

from recordings import read

pytestmark = pytest.mark.browser

TAG = "LC74_20"
BEATING = "Number(document.body.dataset.beats) > 1"
NOTED = """
    window.noted = [];
    const note = () => window.noted.push([Date.now() / 1000, document.getElementById("valves").innerText]);
    new MutationObserver(note).observe(document.getElementById("valves"), { childList: true, subtree: true });
"""
GOOD = "/(^|\\n)\\s*good/i"
STATES = ("failure", "check function", "out of specification", "maintenance required", "good")
SILENT = re.compile(r"No data for (\d+)\ss: the link is down")


def plant_file(folder: Path, address: str, model: Path, healthy: Path) -> Path:
    """A plant of one valve, with everything that can be watched of it."""
    text = f"""
        name = "Rig"
        [[source]]
        address = "{address}"
        rate_hz = {RATE}
        [[source.valve]]
        tag = "{TAG}"
        map = "damadics"
        model = "{model}"
        calibrate = ["{healthy}"]
        [recordings]
        folder = "recorded"
        [events]
        file = "events.jsonl"
        [metrics]
        listen = "127.0.0.1:0"
        [page]
        listen = "127.0.0.1:0"
    """
    (folder / "plant.toml").write_text(text)
    return folder / "plant.toml"


async def monitor(plant: Path) -> MonitorProcess:
    command = (sys.executable, "-m", "bristle", "monitor", "--plant", str(plant))
    return MonitorProcess(await asyncio.create_subprocess_exec(*command, stdout=PIPE, stderr=PIPE))


def alive(url: str) -> None:
    """Wait until the process of the page answers."""
    urllib.request.urlopen(f"{url}alive", timeout=120.0).close()


def metrics(address: str) -> dict[str, float]:
    """Everything that Prometheus would read, by name and labels."""
    with urllib.request.urlopen(address, timeout=60.0) as answer:
        lines = answer.read().decode().splitlines()
    return {name: float(value) for name, value in (one.rsplit(" ", 1) for one in lines if not one.startswith("#"))}


def state_of(words: str) -> str:
    """The state that a card shows, in the words of NE 107; empty where there is none."""
    return next((state for state in STATES if re.search(rf"\b{state}\b", words, re.IGNORECASE)), "")


def assert_lost_and_found(noted: list[tuple[float, str]], listening: float) -> None:
    """What the page showed, with its times [POSIX s]: silence, and then good, and nothing else of the valve.

    listening : when the device was there again [POSIX s].
    """
    seconds = [int(n) for _, words in noted for n in SILENT.findall(words)]
    assert seconds, "the page never said that data stopped"
    states = [(at, state) for at, state in ((at, state_of(words)) for at, words in noted) if state]
    assert [state for state, _ in groupby(state for _, state in states)][-2:] == ["check function", "good"]
    assert not {state for _, state in states} - {"check function", "good"}, "the link is no matter of the valve"
    back = next(at for at, state in states if state == "good" and at > listening)
    print(f"the page said {seconds[0]} s without data first; good again {back - listening:.2f} s after listening")


@pytest.mark.slow
def test_a_fault_is_on_the_page_in_events_metrics_and_recording_and_lost_data_are_said(
    browser, model, healthy, tmp_path
):
    async def story() -> None:
        watching: MonitorProcess | None = None
        served = await serve(["tcp://127.0.0.1:0"])
        try:
            watching = await monitor(plant_file(tmp_path, served.addresses[0], model, healthy))
            url = (await watching.said("live page: ")).split()[-1]
            measured = (await watching.said("metrics at ")).split()[-1]
            await asyncio.to_thread(alive, url)
            await asyncio.to_thread(browser.open, url)
            await shows(f"{BEATING} && {GOOD}.test(document.body.innerText)")  # it is learned, and watched
            browser.run(NOTED)
            served = await lost_and_found(served)
            async with moved(served.addresses[0]) as plant:
                await plant.write("damadics", "lugre.fs", 640.0)
                await plant.write("damadics", "lugre.fc", 464.0)
                await asyncio.to_thread(browser.open, f"{url}valve?tag={TAG}")
                await shows(f"{BEATING} && /friction has changed/.test(document.getElementById('events').innerText)")
            assert metrics(measured)[f'bristle_valve_events_total{{kind="alarm",valve="{TAG}"}}'] >= 1.0
            assert await watching.end(signal.SIGTERM) == 1
            await shows("!document.getElementById('alarm').hidden")
        finally:
            if watching is not None and watching.process.returncode is None:
                watching.process.kill()
            await served.end()

    async def shows(condition: str) -> None:
        await asyncio.to_thread(browser.wait, condition)

    async def lost_and_found(served: Served) -> Served:
        """Kill the served valve until the page has said so, and start it again until the page says that it is good."""
        await served.end(kill=True)
        await shows("/check function/i.test(document.body.innerText) && /No data for/.test(document.body.innerText)")
        again = await serve(served.addresses)
        listening = time.time()
        await shows(f"!/No data/.test(document.body.innerText) && {GOOD}.test(document.body.innerText)")
        assert_lost_and_found(browser.run("return window.noted;"), listening)
        return again

    asyncio.run(story())
    events = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text().splitlines()]
    assert ("alarm", "friction") in {(event["kind"], event["fault"]) for event in events}
    assert {"link_down", "link_up"} <= {event["kind"] for event in events}
    recorded = [read(path) for path in sorted((tmp_path / "recorded").glob(f"{TAG}-*.h5"))]
    noted = [event for recording in recorded for event in recording.events]
    assert any(event.kind == "link_down" for event in noted)
    judged = [(event["kind"], event["text"]) for event in events if event["kind"] in ("alarm", "cleared")]
    assert [(event.kind, event.text) for event in noted if event.kind in ("alarm", "cleared")] == judged
    assert sum(len(recording.time) for recording in recorded) > 100
