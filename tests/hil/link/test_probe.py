"""`bristle probe`: one read of every register, over every transport, and what it says of a map that does not fit."""

from __future__ import annotations

import json
import tomllib

import pytest

import bristle as br
from bristle.cli.app import run
from hil import Certificates, map_file
from hil.testing import make_loopback_authority

SETTINGS = {"setpoint": 0.4}


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """A served actuator behind TCP, TLS and a serial line, and the addresses of it."""
    made = make_loopback_authority(tmp_path_factory.mktemp("ca"))
    own = Certificates(made.server.certificate, made.server.key, made.server.authority)
    listen = ["tcp://127.0.0.1:0", "tls://127.0.0.1:0", "pty:"]
    with br.serve(listen=listen, settings=SETTINGS, certificates=own) as server:
        tcp, tls, line = server.addresses
        peer = made.client
        keys = f"cert={peer.certificate}&key={peer.key}&ca={peer.authority}"
        yield {"tcp": tcp, "tls": f"{tls}?{keys}", "rtu": line}


def swapped_map(folder, order: str, **changed: object):
    """The shipped map with another byte order, as a user would write it by mistake."""
    lines = map_file("damadics").read_text(encoding="utf-8").split("[[points]]")
    points = [part if "byte_order" in part else f'\nbyte_order = "{order}"{part}' for part in lines[1:]]
    path = folder / "swapped.toml"
    path.write_text("[[points]]".join([lines[0], *points]), encoding="utf-8")
    assert len(tomllib.loads(path.read_text())["points"]) == len(points)
    return path


def probed(capsys, *words: object) -> tuple[int, dict]:
    capsys.readouterr()
    code = run(["probe", *map(str, words), "--json"])
    return code, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("transport", ["tcp", "tls", "rtu"])
def test_every_register_is_read_raw_and_decoded(served, capsys, transport):
    code, found = probed(capsys, served[transport], "--map", "damadics")
    (valve,) = found["valves"]
    points = {one["name"]: one for one in valve["points"]}
    assert (code, valve["good"], valve["advice"]) == (0, len(points), [])
    assert points["setpoint"]["raw"] == ["0x3ECC", "0xCCCD"]  # 0.4 in single precision
    assert points["setpoint"]["value"] == pytest.approx(0.4)
    assert points["setpoint"]["unit"] == "1"
    assert set(points["setpoint"]["other_orders"]) == {"CDAB", "BADC", "DCBA"}
    assert set(points["status"]["other_orders"]) == {"BADC"}


def test_a_wrong_byte_order_is_found(served, capsys, tmp_path):
    code, found = probed(capsys, served["tcp"], "--map", swapped_map(tmp_path, "CDAB"))
    (valve,) = found["valves"]
    assert code == 0
    assert valve["likely_byte_order"] == "ABCD"
    assert 'try byte_order = "ABCD"' in valve["advice"][0]
    setpoint = next(one for one in valve["points"] if one["name"] == "setpoint")
    assert setpoint["other_orders"]["ABCD"] == pytest.approx(0.4)


def test_the_table_names_everything_at_80_columns(served, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert run(["probe", served["tcp"], "--map", "damadics"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    assert "…" not in out
    for word in ("downstream_pressure", "3ECC", "0.4 1", "good", "CDAB", "19 of 19 values good"):
        assert word in out


def test_a_register_that_is_not_there_is_named_and_the_rest_is_read(served, capsys, tmp_path):
    path = tmp_path / "longer.toml"
    extra = '\n[[points]]\nname = "missing"\ntable = "holding"\naddress = 9000\ntype = "uint16"\n'
    path.write_text(map_file("damadics").read_text(encoding="utf-8") + extra, encoding="utf-8")
    code, found = probed(capsys, served["tcp"], "--map", path)
    (valve,) = found["valves"]
    assert (code, valve["good"]) == (0, 19)
    assert "not read: missing" in valve["advice"][0]
    assert "illegal data address" in valve["points"][-1]["reason"]


def test_nobody_there_is_a_negative_answer(served, capsys):
    assert run(["probe", served["tcp"], "--map", "damadics", "--unit", "9"]) == 1
    assert "check the device id" in capsys.readouterr().err


def test_a_recording_has_no_registers(capsys):
    assert run(["probe", "replay:a.h5", "--map", "damadics"]) == 2
    assert "it is a recording, which has no registers" in capsys.readouterr().err
