"""The service over real sockets: trouble of link, disk and sink, killed and begun anew, and what it opens."""

from __future__ import annotations

import asyncio
import errno
import gc
import json
import logging
import os
import re
import signal
import socket
import sys
import threading
import urllib.request
from asyncio.subprocess import DEVNULL, PIPE
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median_low

import numpy as np
import pytest
from link_peers import TcpPeer
from monitor_rig import broken_file
from prometheus_client import generate_latest
from service_rig import PATIENCE, Swinging, plan_of, plant_file, position_mm, running, until

from hil import Health, Service, ServiceOutlets
from hil.service.outlets.metrics import registry_of
from hil.testing import FaultSchedule, TcpFaultInjector
from recordings import read, recover

RECORDED = '[recordings]\nfolder = "rec"\n'
HARM = (
    "delay", "drop", "duplicate", "truncate", "wrong_unit", "wrong_function", "wrong_transaction", "wrong_count",
    "bad_check", "exception", "silence", "close", "garbage", "drip",
)  # fmt: skip


def recorded(folder: Path, tag: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Counter and position [mm] of every recording of a valve, those of a killed service recovered."""
    found = []
    for path in sorted(folder.glob(f"{tag}-*.h5*")):
        if path.suffix != ".h5":
            continue
        recover(path)
        recording = read(path)
        found.append((recording["counter"].values, recording["position"].values))
    return found


def assert_every_value_true(runs: list[tuple[np.ndarray, np.ndarray]]) -> int:
    """Every position is the one that belongs to its counter, or missing; returns how many there are."""
    n = 0
    for counter, position in runs:
        good = np.isfinite(counter) & np.isfinite(position)
        assert np.array_equal(position[good], position_mm(counter[good]).astype(float))
        n += int(good.sum())
    return n


def valve(service: Service, tag: str = "V1"):
    return next(one for one in service.status().valves if one.tag == tag)


@pytest.mark.slow
def test_a_lost_link_is_check_function_until_it_is_back_and_never_a_fault(tmp_path):
    async def story() -> None:
        device = Swinging()
        peer = await TcpPeer(device).start()
        async with running(plan_of(plant_file(tmp_path, peer.port, more=RECORDED))) as service:
            await until(lambda: valve(service).link.samples > 20, "samples")
            assert valve(service).latest["position"] == pytest.approx(0.019, abs=0.007)
            await peer.stop()
            await until(lambda: valve(service).evidence and not valve(service).link.connected, "the loss is seen")
            await until(lambda: "no communication" in valve(service).reason, "the health says so")
            found = valve(service)
            assert found.health is Health.CHECK
            assert found.check
            assert found.latest == {}, "a stale value is not shown"
            n = found.link.samples
            await peer.start()
            await until(lambda: valve(service).link.samples > n + 5, "samples again")
            assert valve(service).link.reconnects >= 1
            await until(lambda: "no communication" not in valve(service).reason, "the health is back")
            recent = service.recent("V1")
            assert len(recent.time_s) == len(recent.position_m) > 20
            assert recent.force_N is None
            await until(lambda: (service.recorded("V1") or 0) > n, "recorded")
        await peer.stop()
        assert device.functions == {4}, "nothing but reading was asked"

    asyncio.run(story())
    assert assert_every_value_true(recorded(tmp_path / "rec", "V1")) > 25
    assert json.loads((tmp_path / "state" / "V1.service.json").read_text())["movements"]["observed_s"] > 0


@pytest.mark.slow
def test_a_disk_and_a_sink_that_fail_or_hang_do_not_hold_up_the_others(tmp_path):
    class Failing:
        name = "failing"

        def send(self, events):
            raise ConnectionError("gone")

        def close(self):
            pass

    async def story() -> None:
        async with TcpPeer(Swinging()) as peer:
            plan = plan_of(plant_file(tmp_path, peer.port, 2, more=RECORDED))
            (tmp_path / "rec").write_text("a file where a folder should be")
            async with running(plan, ServiceOutlets([Failing()])) as service:

                def task(name: str):
                    return next(one for one in service.status().tasks if one.name == name)

                await until(lambda: task("recording V1").restarts >= 2, "recording is tried again")
                assert "nothing can be written there" in task("recording V1").last_error
                await until(lambda: task("failing").restarts >= 1, "the sink is tried again")
                n = valve(service, "V2").link.samples
                await until(lambda: valve(service, "V2").link.samples > n + 20, "reading goes on")
                assert task("detection V2").restarts == 0
                (tmp_path / "rec").unlink()
                await until(lambda: (service.recorded("V1") or 0) > 10, "recording is back")

    asyncio.run(story())


@pytest.mark.slow
def test_a_slow_disk_gets_the_time_it_takes_at_the_end_and_nothing_that_was_read_is_missing(
    tmp_path, monkeypatch, caplog
):
    monkeypatch.setattr("hil.service.service.DRAIN_S", 0.6)
    force, slow = os.fsync, threading.Event()

    def fsync(descriptor: int) -> None:
        if slow.is_set():
            threading.Event().wait(0.1)  # one disk for five valves: longer than the patience in all
        force(descriptor)

    monkeypatch.setattr("os.fsync", fsync)

    async def story() -> dict[str, int]:
        peer = await TcpPeer(Swinging()).start()
        async with running(plan_of(plant_file(tmp_path, peer.port, 5, 50.0, RECORDED))) as service:
            await until(lambda: all(service.recorded(one.tag) for one in service.status().valves), "files are open")
            slow.set()
            await until(lambda: all(one.link.samples > 30 for one in service.status().valves), "samples")
        await peer.stop()
        assert all(service.recorded(one.tag) == one.link.samples for one in service.status().valves)
        return {one.tag: one.link.samples for one in service.status().valves}

    for tag, n_samples in asyncio.run(story()).items():
        ((counter, _),) = recorded(tmp_path / "rec", tag)
        assert len(counter) == n_samples
    assert "nothing went on" not in caplog.text


@pytest.mark.slow
def test_a_disk_that_takes_nothing_does_not_hold_up_the_end_and_what_was_acknowledged_stays(
    tmp_path, monkeypatch, caplog
):
    monkeypatch.setattr("hil.service.service.DRAIN_S", 0.5)
    force, hung, freed = os.fsync, threading.Event(), threading.Event()

    def fsync(descriptor: int) -> None:
        if hung.is_set():
            freed.wait(PATIENCE)
        force(descriptor)

    monkeypatch.setattr("os.fsync", fsync)

    async def story() -> int:
        async with TcpPeer(Swinging()) as peer:
            service, stop = Service(plan_of(plant_file(tmp_path, peer.port, 1, 50.0, RECORDED))), asyncio.Event()
            task = asyncio.create_task(service.run(stop))
            await until(lambda: (service.recorded("V1") or 0) > 20, "something is safe")
            safe = service.recorded("V1")
            hung.set()
            n = valve(service).link.samples
            await until(lambda: valve(service).link.samples > n + 60, "more is read")
            stop.set()
            await until(lambda: "nothing went on" in caplog.text, "it gives up")
            freed.set()
            await asyncio.wait_for(task, PATIENCE)
            return safe

    safe = asyncio.run(story())
    assert "1 recordings are not closed" in caplog.text
    ((counter, _),) = recorded(tmp_path / "rec", "V1")
    assert len(counter) >= safe


@pytest.mark.slow
def test_samples_that_the_disk_refused_are_counted_and_no_other_is_missing(tmp_path, monkeypatch):
    force, refusing = os.fsync, threading.Event()

    def fsync(descriptor: int) -> None:
        if refusing.is_set():
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        force(descriptor)

    monkeypatch.setattr("os.fsync", fsync)

    async def story() -> tuple[int, int, int]:
        peer = await TcpPeer(Swinging()).start()
        async with running(plan_of(plant_file(tmp_path, peer.port, 1, 50.0, RECORDED))) as service:

            def recording():
                return next(one for one in service.status().tasks if one.name == "recording V1")

            await until(lambda: (service.recorded("V1") or 0) > 20, "something is safe")
            refusing.set()
            await until(lambda: recording().restarts >= 1, "the disk refuses")
            refusing.clear()
            safe = service.recorded("V1")
            await until(lambda: service.recorded("V1") > safe + 20, "recording is back")
        await peer.stop()
        return service.recorded("V1"), recording().dropped, valve(service).link.samples

    safe, dropped, read_ = asyncio.run(story())
    assert dropped > 0
    assert safe + dropped == read_
    assert sum(len(counter) for counter, _ in recorded(tmp_path / "rec", "V1")) >= safe


class Gathering:
    """A sink that keeps everything."""

    name = "gathering"

    def __init__(self) -> None:
        self.events = []

    def send(self, events):
        self.events += events

    def close(self):
        pass


@pytest.mark.slow
def test_a_fault_is_told_everywhere_and_what_was_learned_is_resumed(model, healthy, tmp_path, caplog):
    caplog.set_level(logging.INFO, "bristle.monitor")
    broken = broken_file(healthy, tmp_path / "broken.h5")
    lines = ['name = "Played"', "[[source]]", 'address = "replay:broken.h5"', "[[source.valve]]", 'tag = "X"']
    known = [f'model = "{model}"', f'calibrate = ["{healthy}"]']
    (tmp_path / "plant.toml").write_text("\n".join([*lines, *known, RECORDED]))

    def played() -> tuple[Service, Gathering]:
        sink = Gathering()
        service = Service(plan_of(tmp_path / "plant.toml"), ServiceOutlets([sink]))
        asyncio.run(service.run(asyncio.Event()))
        return service, sink

    service, sink = played()
    alarms = [event for event in sink.events if event.kind == "alarm"]
    assert 30.0 < alarms[0].t_s - float(read(broken).time[0]) < 32.0
    assert service.alarms == service.counts("X")["alarm"] == len(alarms)
    found = valve(service, "X")
    assert found.events[-1] in sink.events
    assert found.phase == "alarm"
    assert found.health is not Health.GOOD
    recent = service.recent("X")
    assert np.nanmax(recent.residual / recent.threshold) >= 1.0
    assert recent.force_N is not None
    assert f'bristle_valve_events_total{{kind="alarm",valve="X"}} {len(alarms)}.0' in exported(service)
    told = [(event.kind, event.text) for event in sink.events if event.judged]
    (path,) = (tmp_path / "rec").glob("X-*.h5")
    noted = [event for event in read(path).events if event.kind in ("alarm", "cleared")]
    assert [(event.kind, event.text) for event in noted] == told
    begun = float(read(broken).time[0])
    assert noted[0].time == pytest.approx(alarms[0].t_s - begun, abs=0.2), "on the recording's own clock"
    assert "resumed from" not in caplog.text
    (tmp_path / "plant.toml").write_text("\n".join([*lines, f'model = "{model}"']))
    again, _ = played()
    assert "X: resumed from" in caplog.text
    assert valve(again, "X").phase != "learning"


def exported(service: Service) -> str:
    return generate_latest(registry_of(service)).decode()


@contextmanager
def nothing_unhandled() -> Iterator[None]:
    """Fails when anything was raised that nobody caught: in an event loop, a thread, or where nothing can be raised."""
    found: list[object] = []
    hooks, logger = (threading.excepthook, sys.unraisablehook), logging.getLogger("asyncio")
    handler = logging.Handler(logging.ERROR)
    handler.emit = found.append
    threading.excepthook = sys.unraisablehook = found.append
    logger.addHandler(handler)
    try:
        yield
        gc.collect()  # a task whose exception nobody asked for says so when it goes
    finally:
        threading.excepthook, sys.unraisablehook = hooks
        logger.removeHandler(handler)
    assert not found, found


async def chaos(folder: Path, seconds: float, seed: int) -> tuple[list[float], list[int]]:
    """A service behind a line on which everything goes wrong. Returns memory [MB] and descriptors, ten times."""
    device = Swinging()
    schedule = FaultSchedule.even(0.3, *HARM, seed=seed, delay_s=0.3)
    used = []
    async with TcpPeer(device) as peer, TcpFaultInjector("127.0.0.1", peer.port, schedule) as line:
        plan = plan_of(plant_file(folder, line.port, 2, 50.0, RECORDED, timeout_s=0.3))
        async with running(plan, ServiceOutlets([])) as service:
            await until(lambda: all(service.recorded(tag) for tag in ("V1", "V2")), "the files are open")
            for _ in range(10):
                memory, descriptors = zip(*[await used_after(seconds / 400) for _ in range(40)], strict=True)
                used.append((memory[-1], median_low(descriptors)))  # made anew, a connection has more for a moment
                for one in service.status().valves:
                    assert one.health not in (Health.FAILURE, Health.MAINTENANCE), "trouble of the link is no fault"
            tasks = {task.name: task for task in service.status().tasks}
            assert all(one.link.samples > 0 for one in service.status().valves)
    assert device.functions == {4}
    assert sum(line.injector.counts.values()) > 10
    assert all(task.restarts == 0 for task in tasks.values()), tasks
    print(f"{dict(line.injector.counts)}; {used}")
    sizes, descriptors = (list(column) for column in zip(*used, strict=True))
    assert max(descriptors[5:]) <= max(descriptors[:5]) + 2, "a connection or two more or less"
    return sizes, descriptors


async def used_after(seconds: float) -> tuple[float, int]:
    """`usage` after so long."""
    await asyncio.sleep(seconds)
    return usage()


def usage() -> tuple[float, int]:
    """Resident memory [MB] and open descriptors of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6, len(os.listdir("/proc/self/fd"))


@pytest.mark.parametrize("seconds", [4.0, pytest.param(60.0, marks=pytest.mark.slow)])
def test_chaos_on_the_line_gives_no_wrong_value_no_exception_and_no_fault(seconds, tmp_path):
    with nothing_unhandled():
        sizes, _ = asyncio.run(chaos(tmp_path, seconds, seed=4))
    assert sizes[-1] - sizes[4] < 10.0, "memory [MB], while the rings still fill"
    assert sum(assert_every_value_true(recorded(tmp_path / "rec", tag)) for tag in ("V1", "V2")) > 5


class ServiceProcess:
    """`bristle monitor --plant` in its process."""

    @classmethod
    async def start(cls, path: Path, **environment: str) -> ServiceProcess:
        self = cls()
        command = (sys.executable, "-m", "bristle", "monitor", "--plant", str(path), "--metrics", "127.0.0.1:0")
        self.process = await asyncio.create_subprocess_exec(
            *command, stdout=DEVNULL, stderr=PIPE, env=os.environ | environment
        )
        said = ""
        async with asyncio.timeout(PATIENCE):
            while "metrics at" not in said:
                line = await self.process.stderr.readline()
                assert line, f"it ended: {said}"
                said += line.decode()
        self.said, self.url = said, re.search(r"http://\S+", said)[0]
        return self

    async def metric(self, name: str) -> float:
        text = await asyncio.to_thread(lambda: urllib.request.urlopen(self.url, timeout=20).read().decode())
        found = re.search(rf"^{re.escape(name)} (\S+)$", text, re.MULTILINE)
        return float(found[1]) if found else 0.0

    async def reached(self, name: str, least: float) -> float:
        async with asyncio.timeout(PATIENCE):
            while (value := await self.metric(name)) < least:
                await asyncio.sleep(0.1)
        return value

    def listening(self) -> set[tuple[str, str]]:
        """Where the process itself listens: kind and address, by its own descriptors."""
        pid, own = self.process.pid, set()
        for fd in os.listdir(f"/proc/{pid}/fd"):
            found = re.match(r"socket:\[(\d+)\]", os.readlink(f"/proc/{pid}/fd/{fd}"))
            own |= {found[1]} if found else set()
        places = set()
        for kind in ("tcp", "tcp6", "udp", "udp6"):
            for line in Path(f"/proc/{pid}/net/{kind}").read_text().splitlines()[1:]:
                words = line.split()
                if words[9] in own and (words[3] == "0A" or kind.startswith("udp")):
                    places.add((kind, words[1]))
        return places


RECORDED_V1 = 'bristle_valve_samples_recorded_total{valve="V1"}'


@pytest.mark.slow
def test_killed_and_begun_anew_nothing_acknowledged_is_lost_and_only_the_metrics_are_open(tmp_path):
    async def story() -> float:
        device = Swinging()
        async with TcpPeer(device) as peer:
            events = '[events]\nfile = "events.jsonl"\n'
            path = plant_file(tmp_path, peer.port, more=RECORDED + events)
            first = await ServiceProcess.start(path)
            safe = await first.reached(RECORDED_V1, 40)
            port = int(first.url.split(":")[2].split("/")[0])
            assert first.listening() == {("tcp", f"0100007F:{port:04X}")}
            first.process.kill()
            await first.process.wait()
            told = (tmp_path / "events.jsonl").read_text().splitlines()
            assert all(json.loads(line)["kind"] for line in told)
            (tmp_path / "state" / "V1.service.json").write_bytes(b"torn by a power cut")
            second = await ServiceProcess.start(path)
            assert "it is set aside" in second.said
            await second.reached(RECORDED_V1, 10)
            second.process.send_signal(signal.SIGTERM)
            assert await asyncio.wait_for(second.process.wait(), PATIENCE) == 0
            assert device.functions == {4}
            return safe

    safe = asyncio.run(story())
    runs = recorded(tmp_path / "rec", "V1")
    assert len(runs) == 2
    assert len(runs[0][0]) >= safe
    assert_every_value_true(runs)
    assert list((tmp_path / "state").glob("*.unusable"))


@pytest.mark.slow
def test_systemd_is_told_by_the_process_itself_that_it_is_ready_alive_and_stopping(tmp_path):
    """As systemd does it: a datagram socket in the environment, and a watchdog that wants a sign of life."""

    async def story(ear: socket.socket) -> list[bytes]:
        async with TcpPeer(Swinging()) as peer:
            told = {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "1000000"}
            service = await ServiceProcess.start(plant_file(tmp_path, peer.port), **told)
            loop, said = asyncio.get_running_loop(), list[bytes]()
            async with asyncio.timeout(PATIENCE):
                while sum(one.startswith(b"WATCHDOG=1") for one in said) < 3:
                    said.append(await loop.sock_recv(ear, 500))
                service.process.send_signal(signal.SIGTERM)
                while said[-1] != b"STOPPING=1":
                    said.append(await loop.sock_recv(ear, 500))
                assert await service.process.wait() == 0
        return said

    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear:
        ear.bind(str(tmp_path / "notify"))
        ear.setblocking(False)
        said = asyncio.run(story(ear))
    assert said[0].startswith(b"READY=1\nSTATUS=1 valves")
    assert not any(one.startswith(b"READY=1") for one in said[1:])
