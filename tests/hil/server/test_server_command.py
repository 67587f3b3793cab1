"""`bristle serve` as a process: what it prints, how it stops, and what it says of things that cannot be."""

from __future__ import annotations

import asyncio
import json
import signal
import subprocess
import sys

import pytest
from served_ramp import port_of

from bristle.cli.app import run
from hil import Polling, RegisterMap, Sample, Valve, open_source

COMMAND = [sys.executable, "-m", "bristle", "serve"]


def started(*options):
    """A serving process and its first line."""
    process = subprocess.Popen([*COMMAND, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return process, json.loads(process.stdout.readline())


def ended(process, how):
    process.send_signal(how)
    out, err = process.communicate(timeout=30)
    return process.returncode, json.loads(out), err


def test_it_says_where_it_listens_serves_and_stops_on_sigterm():
    process, opening = started("--listen", "tcp://127.0.0.1:0", "--listen", "pty:", "--units", "2", "--noise")
    assert opening["listening"][1].startswith("rtu:/dev/")
    assert (opening["units"], opening["mode"], opening["map"]) == ([1, 2], "1 x real time", "damadics")
    assert port_of(opening["listening"][0]) > 0
    code, closing, err = ended(process, signal.SIGTERM)
    assert (code, closing["stopped_by"], err) == (0, "SIGTERM", "")
    assert closing["units"]["2"]["lateness_max_s"] >= closing["units"]["2"]["lateness_p50_s"] >= 0


def test_ctrl_c_is_an_interruption_with_its_report():
    process, opening = started("--listen", "tcp://127.0.0.1:0", "--lock-step")
    assert opening["mode"] == "lock-step"
    code, closing, err = ended(process, signal.SIGINT)
    assert (code, closing["stopped_by"]) == (130, "SIGINT")
    assert "Traceback" not in err
    assert closing["units"]["1"] == {"samples": 0, "requests": 0, "refused": 0}


def test_a_duration_is_a_regular_end():
    options = ["--listen", "tcp://127.0.0.1:0", "--duration", "0.05"]
    done = subprocess.run([*COMMAND, *options], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert json.loads(done.stdout.splitlines()[1])["stopped_by"] == "duration"


def refused(capsys, *options):
    """The one line that the command says of options that cannot be."""
    assert run(["serve", *options]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    return err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--listen", "tcp://0.0.0.0:0"], "expose it if it is meant (--expose)"),
        (["--listen", "serial"], "is not an address"),
        (["--listen", "rtu:/dev/no-such-line"], "there is no serial device"),
        (["--listen", "tls://127.0.0.1:0"], "--cert"),
        (["--listen", "tls://127.0.0.1:0", "--cert", "a", "--key", "b", "--ca", "c"], "a: cannot be read"),
        (["--scenario", "f4-incipent"], "f4-incipient"),
        (["--fault", "4:strength=2"], "a strength is 0 to 1"),
        (["--fault", "20"], "1 to 19"),
        (["--fault", "4:strenght=1"], "unknown word 'strenght'"),
        (["--fault", "1:direction=-1"], "direction 1 only"),
        (["--fault", "4:from=nan"], "not a number"),
        (["--friction", "sand"], "play or lugre"),
        (["--effect", "backlash:width=-1", "--friction", "lugre"], "backlash"),
        (["--set", "lugre.fc=100"], "need the form 'lugre'"),
        (["--set", "weight=1"], "no setting 'weight'"),
        (["--set", "mass=0"], "finite and positive"),
        (["--map", "nowhere.toml"], "no such file"),
        (["--map", "damadics-write"], "a map for reading"),
        (["--speed", "0"], "--speed"),
        (["--units", "248"], "--units"),
        (["--duration", "nan"], "--duration"),
    ],
)
def test_what_cannot_be_is_one_line_and_exit_code_2(options, words, capsys):
    assert words in refused(capsys, *options)


def test_a_map_with_overlapping_addresses_is_refused(tmp_path, capsys):
    point = '[[points]]\nname = "{}"\ntable = "input"\naddress = 0\ntype = "float32"\n'
    (tmp_path / "m.toml").write_text('name = "m"\n' + point.format("drive") + point.format("setpoint"))
    assert "'setpoint' overlaps 'drive'" in refused(capsys, "--map", str(tmp_path / "m.toml"))


@pytest.mark.slow
def test_it_makes_certificates_and_serves_with_them(tmp_path):
    folder = tmp_path / "ca"
    made = subprocess.run([*COMMAND, "--make-test-ca", str(folder)], capture_output=True, text=True, check=True)
    server_line, client_line = made.stdout.splitlines()
    options = server_line.removeprefix("server: ").split()
    process, opening = started("--listen", "tls://127.0.0.1:0", "--lock-step", *options)

    async def first_sample():
        query = client_line.removeprefix("client: ")
        valve = Valve("v", RegisterMap.load("damadics"))
        async with open_source(f"{opening['listening'][0]}?{query}", [valve], Polling(20.0)) as source:
            async for item in source:
                if isinstance(item, Sample):
                    return item.readings["step"].value
        return None

    try:
        assert asyncio.run(asyncio.wait_for(first_sample(), 20)) == pytest.approx(0.0025)
    finally:
        code, _, _ = ended(process, signal.SIGTERM)
    assert code == 0
