"""The whole of it with real parts: a served valve, the monitor, its page in a browser, and a fault set by register."""

from __future__ import annotations

import asyncio
import json
import re
import signal

import pytest
from monitor_rig import MonitorProcess, Served, moved, serve

from recordings import read

pytestmark = pytest.mark.browser

BEATING = "Number(document.body.dataset.beats) > 1"
NOTED = """
    window.noted = [];
    const note = () => {
        const words = document.getElementById("valves").innerText;
        if (window.noted.at(-1) !== words) window.noted.push(words);
    };
    new MutationObserver(note).observe(document.getElementById("valves"), { childList: true, subtree: true });
"""
SILENT = re.compile(r"No data for (\d+)\ss")


def test_lost_found_and_alarmed_the_page_shows_what_events_and_recording_say(browser, model, healthy, tmp_path):
    async def story() -> MonitorProcess:
        served = await serve(["tcp://127.0.0.1:0"])
        try:
            options = ("--calibrate", str(healthy), "--false-alarms", "1", "--valve", "LC74_20", "--page", "0")
            record, state = ("--record", str(tmp_path / "rec")), ("--state", str(tmp_path / "state.json"))
            async with moved(served.addresses[0]):
                monitor = await MonitorProcess.start(served.addresses[0], model, *options, *record, *state)
                url = (await monitor.said("live page: ")).split()[-1]
                await asyncio.to_thread(browser.open, url)
                await asyncio.to_thread(browser.wait, f"{BEATING} && {badge()} === 'good'")
                browser.run(NOTED)
            served = await lost_and_found(served)
            async with moved(served.addresses[0]) as plant:
                await plant.write("damadics", "lugre.fs", 640.0)
                await plant.write("damadics", "lugre.fc", 464.0)
                alarm = await monitor.event("alarm", fault="friction", patience=30.0)
                await asyncio.to_thread(browser.wait, f"{badge()} === 'M maintenance required'")
                await asyncio.to_thread(browser.open, f"{url}valve?tag=LC74_20")
                await asyncio.to_thread(browser.wait, BEATING)
                events = browser.run("return document.getElementById('events').innerText;")
                assert alarm["text"] in events
                assert await monitor.end(signal.SIGTERM) == 1
                return monitor
        finally:
            await served.end()

    async def lost_and_found(served: Served) -> Served:
        """Kill the served valve, wait until the page says so, start it again, and wait until the page has data."""
        await served.end(kill=True)
        await asyncio.to_thread(browser.wait, "/No data for/.test(document.body.innerText)")
        seconds = [int(n) for words in browser.run("return window.noted;") for n in SILENT.findall(words)]
        assert seconds[0] <= 2
        again = await serve(served.addresses)
        await asyncio.to_thread(browser.wait, f"!/No data/.test(document.body.innerText) && {badge()} === 'good'")
        assert "mm" in browser.run("return document.getElementById('valves').innerText;")
        return again

    monitor = asyncio.run(story())
    assert [event["kind"] for event in monitor.events].count("link_down") == 1
    recorded = next((tmp_path / "rec").glob("LC74_20-*.h5"))
    assert any(event.kind == "link_down" for event in read(recorded).events)
    assert json.loads((tmp_path / "state.json").read_text())["valves"].keys() == {"LC74_20"}


def badge() -> str:
    """The state of the only valve, in the browser."""
    return "document.querySelector('li .badge').innerText.replace(/\\s+/g, ' ').trim()"
