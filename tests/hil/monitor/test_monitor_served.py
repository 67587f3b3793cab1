"""`bristle monitor` against `bristle serve`, each in its process: over TCP, RTU and TLS, with faults and without."""

from __future__ import annotations

import asyncio
import json
import signal
from pathlib import Path

import pytest
from monitor_rig import MonitorProcess, moved, passed, serve

from bristle.cli.app import run
from hil import LiveSource
from hil.testing import make_loopback_authority
from recordings import read


def decisions(lines: str) -> list[dict]:
    return [event for event in map(json.loads, lines.splitlines()) if event["kind"] in ("alarm", "cleared", "gap")]


SEVERE = ("--valve", "LC74_20", "--false-alarms", "100")
"""Options of the valve's name, and of alarms that come early."""


async def rubbed(plant: LiveSource) -> None:
    """Let the friction of the served valve rise to four times its size."""
    await plant.write("damadics", "lugre.fs", 640.0)
    await plant.write("damadics", "lugre.fc", 464.0)


def told_as_recorded(events: list[dict], folder: Path) -> list[dict]:
    """The detector's own events, all of one valve, when those that the recording keeps are the same."""
    assert {event["valve"] for event in events} == {"LC74_20"}
    live = [event for event in events if event["kind"] in ("alarm", "cleared", "gap")]
    kept = read(next(folder.glob("*.h5"))).events
    noted = [(event.kind, event.text) for event in kept if event.kind in ("alarm", "cleared")]
    assert noted == [(event["kind"], event["text"]) for event in live if event["kind"] != "gap"]
    return live


@pytest.mark.slow
def test_over_tcp_a_friction_fault_is_found_and_a_replay_of_the_recording_decides_the_same(
    model, healthy, tmp_path, capsys
):
    async def story() -> list[dict]:
        served = await serve(["tcp://127.0.0.1:0"])
        try:
            async with moved(served.addresses[0]) as plant:
                options = (*SEVERE, "--calibrate", str(healthy), "--record", str(tmp_path / "rec"))
                monitor = await MonitorProcess.start(served.addresses[0], model, *options)
                await monitor.event("link_up")
                await passed(served.addresses[0], 30)  # the fault must not come while the detector still settles
                await rubbed(plant)
                await monitor.event("alarm")
                assert await monitor.end(signal.SIGTERM) == 1
                return monitor.events
        finally:
            await served.end()

    live = told_as_recorded(asyncio.run(story()), tmp_path / "rec")
    assert live[0]["kind"] == "alarm"
    recording = next((tmp_path / "rec").glob("*.h5"))
    assert run(["replay", str(recording), "--model", str(model), "--calibrate", str(healthy), *SEVERE[2:]]) == 1
    assert decisions(capsys.readouterr().out) == live


@pytest.mark.slow
def test_learned_live_over_tcp_a_friction_fault_is_named_and_a_replay_decides_the_same(model, tmp_path, capsys):
    async def story() -> list[dict]:
        served = await serve(["tcp://127.0.0.1:0"])
        try:
            async with moved(served.addresses[0]) as plant:
                state, record = ("--state", str(tmp_path / "state.json")), ("--record", str(tmp_path / "rec"))
                monitor = await MonitorProcess.start(
                    served.addresses[0], model, "--learn", "18", *SEVERE, *record, *state
                )
                assert "support at most one in" in await monitor.said("false alarms")
                await rubbed(plant)
                first = await monitor.event("alarm")
                named = first if first["fault"] == "friction" else await monitor.event("alarm", fault="friction")
                assert named["t_s"] - first["t_s"] < 20.0
                assert await monitor.end(signal.SIGTERM) == 1
                return monitor.events
        finally:
            await served.end()

    live = told_as_recorded(asyncio.run(story()), tmp_path / "rec")
    assert json.loads((tmp_path / "state.json").read_text())["valves"].keys() == {"LC74_20"}
    recording = next((tmp_path / "rec").glob("*.h5"))
    assert run(["replay", str(recording), "--model", str(model), "--learn", "18", *SEVERE[2:]]) == 1
    assert decisions(capsys.readouterr().out) == live


@pytest.mark.slow
def test_over_rtu_a_spring_fault_is_found_by_what_was_learned_from_a_recording(model, healthy, tmp_path):
    async def story() -> None:
        served = await serve(["tcp://127.0.0.1:0", "pty:"])
        try:
            async with moved(served.addresses[0]) as plant:
                state = ("--state", str(tmp_path / "state.json"))
                options = ("--calibrate", str(healthy), "--false-alarms", "100", *state)
                monitor = await MonitorProcess.start(served.addresses[1], model, *options)
                await monitor.event("link_up")
                await passed(served.addresses[0], 30)  # the fault must not come while the detector still settles
                await plant.write("damadics", "fault_strength", 0.75)
                await plant.write("damadics", "fault", 11.0)
                first = await monitor.event("alarm")
                assert first["residual"] > first["threshold"]
                await monitor.event("alarm", fault="spring")
                assert await monitor.end(signal.SIGINT) == 1
        finally:
            await served.end()

    asyncio.run(story())


@pytest.mark.slow
def test_over_tls_a_healthy_valve_and_a_killed_server_are_no_alarm_and_what_was_learned_is_resumed(
    model, healthy, tmp_path
):
    sides = make_loopback_authority(tmp_path / "tls")
    server, client = sides.server, sides.client
    keys = ("--cert", str(server.certificate), "--key", str(server.key), "--ca", str(server.authority))

    async def story() -> None:
        served = await serve(["tcp://127.0.0.1:0", "tls://127.0.0.1:0"], *keys)
        plain, secret = served.addresses
        source = f"{secret}?ca={client.authority}&cert={client.certificate}&key={client.key}"
        state = ("--state", str(tmp_path / "state.json"))
        try:
            async with moved(plain):
                monitor = await MonitorProcess.start(
                    source, model, "--calibrate", str(healthy), "--false-alarms", "1", *state
                )
                await monitor.event("link_up")
                await passed(plain, 20)  # a healthy valve is watched
            await served.end(kill=True)
            await monitor.event("link_down")
            served = await serve([plain, secret], *keys)
            async with moved(plain):
                await monitor.event("link_up")
                await passed(plain, 20)
                assert await monitor.end(signal.SIGTERM) == 0
                kinds = {event["kind"] for event in monitor.events}
                assert {"link_up", "link_down"} <= kinds
                assert not kinds & {"alarm", "cleared"}
                again = await MonitorProcess.start(source, model, *state)
                assert "state.json" in await again.said("resumed from")
                await again.event("link_up")
                assert await again.end(signal.SIGINT) == 130
        finally:
            await served.end()

    asyncio.run(story())
