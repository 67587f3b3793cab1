"""`bristle record` as a program: how it ends, what a kill leaves, what it puts on the wire, and what it refuses."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from asyncio.subprocess import PIPE
from datetime import UTC, datetime, timedelta
from pathlib import Path
from random import Random

import h5py
import numpy as np
import pytest
from link_peers import PtyPeer, TcpPeer, within
from link_rig import Rig

import hil
from bristle.cli.app import run
from hil.modbus.framing import split_frames
from hil.testing import make_loopback_authority
from recordings import read, recover

MAP_TEXT = """
name = "rig"
[[points]]
name = "position"
table = "input"
address = 0
type = "float32"
unit = "mm"
valid_range = [0.0, 50.0]
[[points]]
name = "counter"
table = "input"
address = 2
type = "uint16"
[[points]]
name = "alarm"
table = "input"
address = 3
type = "bit"
bit = 4
"""


@pytest.fixture
def map_file(tmp_path) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text(MAP_TEXT)
    return path


def acknowledged(lines: str) -> dict[str, int]:
    """File and number of samples from the lines of `--acknowledge`; of each file the last."""
    pairs = (line.rpartition(" ") for line in lines.splitlines(keepends=True) if line.endswith("\n"))
    return {path: int(number) for path, _, number in pairs if path.endswith(".h5") and number.strip().isdecimal()}


class Program:
    """A running `bristle record`, whose output goes to a file."""

    def __init__(self, folder: Path, *arguments: object) -> None:
        self._arguments = ["record", "--acknowledge", "--batch", "0.02", *(str(argument) for argument in arguments)]
        self._output, self._errors = folder / "output.txt", folder / "errors.txt"

    async def __aenter__(self) -> Program:
        with self._output.open("wb") as output, self._errors.open("wb") as errors:
            command = [sys.executable, "-m", "bristle", *self._arguments]
            self.process = await asyncio.create_subprocess_exec(*command, stdout=output, stderr=errors)
        return self

    async def __aexit__(self, *_: object) -> None:
        if self.process.returncode is None:
            self.process.kill()
            await self.process.wait()

    @property
    def acknowledged(self) -> dict[str, int]:
        return acknowledged(self._output.read_text())

    @property
    def errors(self) -> str:
        return self._errors.read_text()

    async def until(self, n_samples: int) -> None:
        """Wait until so many samples are acknowledged."""

        async def enough() -> None:
            while sum(self.acknowledged.values()) < n_samples:
                assert self.process.returncode is None, self.errors
                await asyncio.sleep(0.01)

        await within(enough(), 60.0)

    async def end(self) -> int:
        """Wait for the exit code."""
        return await within(self.process.wait(), 60.0)


def check_file(path: Path, n_samples: int) -> None:
    """All acknowledged samples are in the file as any program sees it: positions and counters as they were served."""
    with h5py.File(path) as file:
        columns = {name: file["signals"][name][:n_samples] for name in ("time", "position", "counter")}
    assert {len(column) for column in columns.values()} == {n_samples}
    assert np.isfinite(columns["time"]).all()
    assert (np.diff(columns["time"]) > 0).all()
    assert (columns["position"] == 12.5).all()
    assert (np.diff(columns["counter"]) == 1).all()


@pytest.mark.parametrize(
    ("end", "code"), [(signal.SIGTERM, 0), pytest.param(signal.SIGINT, 130, marks=pytest.mark.slow)]
)
def test_a_signal_ends_it_cleanly_and_everything_acknowledged_is_there(tmp_path, map_file, end, code):
    async def story() -> tuple[int, dict[str, int], str]:
        async with TcpPeer(Rig()) as peer:
            source, to = f"tcp://127.0.0.1:{peer.port}", tmp_path / "runs"
            async with Program(tmp_path, "--source", source, "--map", map_file, "--to", to, "--rate", 200) as program:
                await program.until(20)
                program.process.send_signal(end)
                return await program.end(), program.acknowledged, program.errors

    returned, safe, errors = asyncio.run(story())
    assert returned == code, errors
    ((path, n_samples),) = safe.items()
    assert len(read(path)) == n_samples
    check_file(Path(path), n_samples)
    assert not list((tmp_path / "runs").glob("*.journal"))


LAUNCHER = """
import json, os, signal, sys
import hil, bristle.cli.commands.record
from bristle.cli.app import run
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
for line in sys.stdin:
    output, arguments = json.loads(line)
    child = os.fork()
    if child == 0:
        os.dup2(os.open(output, os.O_WRONLY | os.O_CREAT), 1)
        os._exit(run(arguments))
    print(child, flush=True)
"""


class Launcher:
    """Starts `bristle record` again and again in processes of their own, without importing everything each time."""

    async def __aenter__(self) -> Launcher:
        command = [sys.executable, "-c", LAUNCHER]
        self._process = await asyncio.create_subprocess_exec(*command, stdin=PIPE, stdout=PIPE)
        self._turn = asyncio.Lock()
        return self

    async def __aexit__(self, *_: object) -> None:
        self._process.kill()
        await self._process.wait()

    async def start(self, output: Path, *arguments: object) -> int:
        """Start a recorder; returns its process id."""
        words = ["record", "--acknowledge", "--batch", "0.02", *(str(argument) for argument in arguments)]
        async with self._turn:
            self._process.stdin.write(json.dumps([str(output), words]).encode() + b"\n")
            return int(await within(self._process.stdout.readline(), 60.0))


async def kill_one(n: int, launcher: Launcher, peer: TcpPeer, folder: Path, random: Random) -> tuple[Path, int]:
    """Start a recorder and kill it at a random moment; returns its file and what it had acknowledged."""
    to, output, enough = folder / f"{n}.h5", folder / f"{n}.txt", 1 + random.randrange(60)
    source, unit = f"tcp://127.0.0.1:{peer.port}", n % 200 + 1
    arguments = ("--source", source, "--map", folder / "rig.toml", "--to", to, "--rate", 500, "--unit", unit)
    child = await launcher.start(output, *arguments)
    while not output.exists() or acknowledged(output.read_text()).get(str(to), 0) < enough:
        await asyncio.sleep(0.005)
    await asyncio.sleep(random.uniform(0.0, 0.04))  # anywhere between two batches, or within one
    os.kill(child, signal.SIGKILL)
    while Path(f"/proc/{child}").exists():
        await asyncio.sleep(0.001)
    return to, acknowledged(output.read_text())[str(to)]


def killed_at_random(folder: Path, n_kills: int, seed: int) -> list[tuple[Path, int]]:
    """Kill as many recorders, five at a time; returns each one's file and what it had acknowledged."""
    random = Random(seed)

    async def story() -> list[tuple[Path, int]]:
        ends: list[tuple[Path, int]] = []
        async with TcpPeer(PerUnit()) as peer, Launcher() as launcher:
            for start in range(0, n_kills, 5):
                kills = [kill_one(n, launcher, peer, folder, random) for n in range(start, min(start + 5, n_kills))]
                ends += await within(asyncio.gather(*kills), 60.0)
        return ends

    return asyncio.run(story())


class PerUnit:
    """One rig for every device id, so that several recorders can run at once."""

    def __init__(self) -> None:
        self._rigs: dict[int, Rig] = {}

    def __call__(self, unit: int, function: int, address: int, count: int) -> object:
        return self._rigs.setdefault(unit, Rig())(unit, function, address, count)


def check_killed(ends: list[tuple[Path, int]]) -> None:
    for path, n_samples in ends:
        check_file(path, n_samples)
        recover(path)
        check_file(path, n_samples)
        assert len(read(path)) >= n_samples


@pytest.mark.parametrize("kills", [5, pytest.param(20, marks=pytest.mark.slow)])
def test_kills_lose_nothing_that_was_acknowledged(tmp_path, map_file, kills):
    ends = killed_at_random(map_file.parent, kills, seed=1)
    assert len(ends) == kills
    check_killed(ends)


@pytest.mark.long
def test_two_hundred_kills_lose_nothing_that_was_acknowledged(tmp_path, map_file):
    ends = killed_at_random(map_file.parent, 200, seed=2)
    assert len(ends) == 200
    check_killed(ends)


def test_a_session_puts_no_write_function_code_on_the_wire(tmp_path, map_file):
    """Every byte towards the device, taken from the wire between the two."""

    async def story() -> tuple[bytes, int]:
        wire = bytearray()
        async with TcpPeer(Rig()) as peer:

            async def pass_on(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
                answers, requests = await asyncio.open_connection("127.0.0.1", peer.port)

                async def back() -> None:
                    while data := await answers.read(4096):
                        writer.write(data)

                task = asyncio.create_task(back())
                while data := await reader.read(4096):
                    wire.extend(data)
                    requests.write(data)
                task.cancel()
                requests.close()

            proxy = await asyncio.start_server(pass_on, "127.0.0.1", 0)
            source = f"tcp://127.0.0.1:{proxy.sockets[0].getsockname()[1]}"
            to = tmp_path / "runs"
            async with Program(tmp_path, "--source", source, "--map", map_file, "--to", to, "--rate", 200) as program:
                await program.until(50)
                program.process.terminate()
                await program.end()
            proxy.close()
            return bytes(wire), len(peer.requests)

    wire, n_requests = asyncio.run(story())
    frames, rest, broken = split_frames(wire)
    assert (rest, broken) == (b"", None)
    assert len(frames) == n_requests >= 50
    assert {frame.pdu[0] for frame in frames} == {4}


def test_a_session_on_a_serial_line_only_reads(tmp_path, map_file):
    async def story() -> tuple[int, set[int], str]:
        async with PtyPeer(Rig()) as peer:
            source = f"rtu:{peer.path}?baud=115200&parity=N&quiet=0.02"
            arguments = ("--source", source, "--map", map_file, "--to", tmp_path / "run.h5", "--rate", 50)
            async with Program(tmp_path, *arguments) as program:
                await program.until(6)
                program.process.send_signal(signal.SIGTERM)
                code = await program.end()
            return code, {request.function for request in peer.requests}, program.errors

    code, functions, errors = asyncio.run(story())
    assert code == 0, errors
    assert functions == {4}
    assert len(read(tmp_path / "run.h5")) >= 6


def test_it_says_when_nothing_came(tmp_path, map_file, capsys):
    async def free_port() -> int:
        peer = await TcpPeer(Rig()).start()
        await peer.stop()
        return peer.port

    source = f"tcp://127.0.0.1:{asyncio.run(free_port())}"
    arguments = ["--source", source, "--map", str(map_file), "--to", str(tmp_path / "runs"), "--duration", "0.3"]
    assert run(["record", *arguments]) == 1
    errors = capsys.readouterr().err
    assert "link_down" in errors
    assert "nothing was recorded" in errors
    assert not list((tmp_path / "runs").iterdir())


def test_polling_that_dies_is_an_exit_code(tmp_path, map_file, monkeypatch, capsys):
    class Dying(hil.Polling):
        async def run(self, *work: object) -> None:
            raise ZeroDivisionError("no such luck")

    monkeypatch.setattr(hil, "Polling", Dying)
    arguments = ["--source", "tcp://127.0.0.1:9", "--map", str(map_file), "--to", str(tmp_path / "runs")]
    assert run(["record", *arguments]) == 1
    errors = capsys.readouterr().err
    assert "rig: link_down: the polling task ended: ZeroDivisionError: no such luck" in errors


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--source", "tcp://host:no", "--map", "MAP", "--to", "TO"], "the port is not a number"),
        (["--source", "bus:1", "--map", "MAP", "--to", "TO"], "'bus' is not a kind of source"),
        (["--source", "tcp://127.0.0.1:9", "--map", "nowhere.toml", "--to", "TO"], "nowhere.toml"),
        (["--source", "tcp://127.0.0.1:9", "--to", "TO"], "register map"),
        (["--source", "rtu:/dev/nothing?parity=Q", "--map", "MAP", "--to", "TO"], "parity is one of N, E, O"),
        (["--source", "rtu:/dev/nothing", "--map", "MAP", "--to", "TO"], "there is no serial device /dev/nothing"),
        (["--source", "tls://127.0.0.1:9?ca=a&cert=b&key=c", "--map", "MAP", "--to", "TO"], "cannot be read"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "/proc/bristle"], "nothing can be written there"),
        (["--source", "replay:nothing.h5", "--to", "TO"], "no such file"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--unit", "0"], "device id"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--unit", "a"], "device ids"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--unit", "1,9-2"], "'9-2' is no device id"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--unit", "1-999999999999"], "no device id"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--heartbeat", "x"], "there is no point 'x'"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--ring"], "no ring of samples"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--rate", "nan"], "--rate"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--rate", "0"], "--rate"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--duration", "nan"], "--duration"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--rotate-mb", "inf"], "--rotate-mb"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--plant", "stroke=1"], "--plant"),
        (["--source", "tcp://127.0.0.1:9", "--map", "MAP", "--to", "TO", "--plant", "stroke_m=x"], "not a number"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(arguments, words, tmp_path, map_file, capsys):
    places = {"MAP": str(map_file), "TO": str(tmp_path / "runs")}
    assert run(["record", *[places.get(argument, argument) for argument in arguments]]) == 2
    errors = capsys.readouterr().err
    assert words in errors
    assert errors.count("\n") == 1


def test_an_expired_certificate_is_bad_input(tmp_path, map_file, capsys):
    files = make_loopback_authority(tmp_path / "ca", days=1, start=datetime.now(UTC) - timedelta(days=9)).client
    source = f"tls://127.0.0.1:9?ca={files.authority}&cert={files.certificate}&key={files.key}"
    assert run(["record", "--source", source, "--map", str(map_file), "--to", str(tmp_path / "runs")]) == 2
    assert "expired on" in capsys.readouterr().err


def test_a_replayed_recording_is_recorded_with_its_events_and_name(tmp_path, map_file):
    async def story() -> None:
        async with TcpPeer(Rig()) as peer:
            source = f"tcp://127.0.0.1:{peer.port}"
            arguments = ("--source", source, "--map", map_file, "--to", tmp_path / "first.h5", "--rate", 200)
            async with Program(tmp_path, *arguments, "--valve", "LC74", "--plant", "stroke_m=0.04") as program:
                await program.until(30)
                program.process.terminate()
                await program.end()

    asyncio.run(story())
    assert run(["record", "--source", f"replay:{tmp_path / 'first.h5'}", "--to", str(tmp_path / "second.h5")]) == 0
    first, second = read(tmp_path / "first.h5"), read(tmp_path / "second.h5")
    assert (first.plant.tag, first.plant.stroke_m) == ("LC74", 0.04)
    assert second.plant.tag == "LC74"
    assert [(event.kind, event.text) for event in second.events] == [(event.kind, event.text) for event in first.events]
    assert [event.time for event in second.events] == pytest.approx([event.time for event in first.events])
    assert np.array_equal(second["position"].values, first["position"].values)


def test_a_map_that_does_not_fit_the_device_ends_it_at_once_and_what_came_can_be_shown(tmp_path, map_file, capsys):
    map_file.write_text(MAP_TEXT.replace("address = 0", "address = 1000").replace("address = 2", "address = 1002"))
    text = map_file.read_text().replace("address = 3", "address = 1003")
    map_file.write_text(text)
    to = tmp_path / "wrong.h5"

    async def story() -> tuple[int, str]:
        async with TcpPeer(Rig()) as peer:
            source = f"tcp://127.0.0.1:{peer.port}"
            async with Program(tmp_path, "--source", source, "--map", map_file, "--to", to, "--rate", 50) as program:
                return await program.end(), program.errors

    code, errors = asyncio.run(story())
    assert code == 1
    assert "not one good value in the first 20 samples (exception 2: illegal data address)" in errors
    assert "Traceback" not in errors
    capsys.readouterr()
    assert run(["show", str(to)]) == 0
    shown = capsys.readouterr().out
    assert "position: 20 not valid" in shown
    assert "illegal data address" in shown
    assert "every sample of position is missing" in shown


def test_a_map_on_which_an_earlier_value_could_not_be_told_is_named_at_the_start(map_file, tmp_path, capsys):
    command = ["record", "--source", "tcp://127.0.0.1:1", "--map", str(map_file), "--to", str(tmp_path / "runs")]
    assert run([*command, "--duration", "0.1"]) == 1
    assert "names no heartbeat" in capsys.readouterr().err.splitlines()[0]
    assert run([*command, "--duration", "0.1", "--heartbeat", "counter"]) == 1
    assert "heartbeat" not in capsys.readouterr().err


def test_reads_whose_replies_no_serial_line_tells_apart_are_named_at_the_start(map_file, tmp_path, capsys):
    apart = MAP_TEXT.replace("address = 0", "address = 200").replace("address = 3", "address = 100")
    map_file.write_text('heartbeat = "counter"\n' + apart)
    command = ["record", "--map", str(map_file), "--to", str(tmp_path / "runs"), "--duration", "0.1", "--source"]
    near, far = os.openpty()
    try:
        assert run([*command, f"rtu:{os.ttyname(far)}?parity=N"]) == 1
    finally:
        os.close(near)
        os.close(far)
    assert "reads from input 2, input 100 have one form" in capsys.readouterr().err.splitlines()[0]
    assert run([*command, "tcp://127.0.0.1:1"]) == 1
    assert "one form" not in capsys.readouterr().err
