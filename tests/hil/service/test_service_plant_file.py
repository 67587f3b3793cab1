"""The plant file: what it takes, what it refuses and in which words, and the check that sends nothing."""

from __future__ import annotations

import asyncio

import pytest
from link_peers import TcpPeer
from service_rig import Swinging, plan_of, plant_file

from bristle.cli.app import run
from hil import PlantFile, http_address
from recordings import BadInput, bundled_path


def test_the_check_says_what_would_be_polled_and_sends_nothing(tmp_path, capsys):
    async def story() -> int:
        async with TcpPeer(Swinging()) as peer:
            path = plant_file(tmp_path, peer.port, 2, 12.5, '[recordings]\nfolder = "rec"\n[metrics]\n')
            assert await asyncio.to_thread(run, ["monitor", "--check", str(path)]) == 0
            assert await asyncio.to_thread(run, ["monitor", "--plant", str(path), "--check"]) == 0
            return peer.n_connections

    assert asyncio.run(story()) == 0
    said = capsys.readouterr().out
    for words in (
        "12.5 rounds of 2 requests a second, 25 requests a second",
        "V2: position, counter, setpoint",
        "unit 2, function 4, registers 0 to 4",
        "http://127.0.0.1:9108/metrics",
        "a new file every 24 h",
    ):
        assert words in said  # fmt: skip
    assert not (tmp_path / "rec").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("rate_hz = 20.0", "rate = 20.0", "source[0].rate: unknown key; did you mean 'rate_hz'?"),
        ("rate_hz = 20.0", "rate_hz = -1.0", "source[0].rate_hz: Input should be greater than"),
        ('name = "Rig"', "", "name: it is missing; give it"),
        ('tag = "V2"', 'tag = "V1"', "the tag 'V1' is there twice; give each valve its own"),
        ('tag = "V2"', 'tag = "../../etc/x"', "source[0].valve[1].tag"),
        ('map = "map.toml"\nmodel = "model.json"\nunit = 2', 'model = "model.json"', "(V2): map: it is missing"),
        ('model = "model.json"\nunit = 2', 'model = "none.json"', "none.json: there is no such file"),
        ("tcp://", "carrier-pigeon://", "'carrier-pigeon' is not a kind of source; write "),
        ('map = "map.toml"', 'map = "nowhere.toml"', "nowhere.toml: there is no such file"),
        ("unit = 2", "unit = 900", "less than or equal to 247"),
        ("learn_s = 1e6", "learn_s = inf", "learn_s"),
        ("learn_s = 1e6", "learn_s = 1e6\ncalibrate = ['gone.h5']", "there is no file"),
        ('name = "Rig"', 'name = "Rig"\nfile = "x"', "file: unknown key"),
        ('name = "Rig"', "name = [[[", "not TOML"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line_with_file_item_and_remedy(old, new, said, tmp_path, capsys):
    path = plant_file(tmp_path, 1, 2)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    assert run(["monitor", "--check", str(path)]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert str(path) in line
    assert said in line


def test_a_plant_file_cannot_exhaust_or_reach_out(tmp_path):
    path = tmp_path / "plant.toml"
    for content in (b"a" * 2_000_000, b"\xff\xfe", b"x=" + b"[" * 100_000, b"x = " + b"9" * 10_000):
        path.write_bytes(content)
        with pytest.raises(BadInput, match=r"plant\.toml"):
            PlantFile.read(path)
    more = '[page]\nlisten = "0.0.0.0:8050"\nexpose = true\n'
    with pytest.raises(BadInput, match="token_file, certificate and key"):
        PlantFile.read(plant_file(tmp_path, 1, more=more))
    with pytest.raises(BadInput, match="other machines can reach"):
        http_address("0.0.0.0:9108", "metrics", False)
    assert http_address("0.0.0.0:9108", "metrics", True) == ("0.0.0.0", 9108)
    many = "\n".join(f'[[source.valve]]\ntag = "W{k}"\nmodel = "m"' for k in range(600))
    with pytest.raises(BadInput, match="it has 601 valves; split it"):
        PlantFile.read(plant_file(tmp_path, 1, more=many))


def test_paths_are_relative_to_the_file_and_options_are_not_shown(tmp_path):
    plan = plan_of(plant_file(tmp_path / "a", 1))
    assert plan.valves[0].model_file == tmp_path / "a" / "model.json"
    assert "?" not in plan.sources[0].shown


def test_a_bundled_recording_is_named_as_everywhere(tmp_path, capsys):
    plant_file(tmp_path, 1)
    lines = ['name = "Played"', "[[source]]", 'address = "replay:bundled:step"', "[[source.valve]]", 'tag = "X"']
    path = tmp_path / "plant.toml"
    path.write_text("\n".join([*lines, 'model = "model.json"', 'calibrate = ["bundled:mixed"]']))
    plan = plan_of(path)
    assert plan.sources[0].address == f"replay:{bundled_path('step')}"
    assert plan.valves[0].calibrate == (bundled_path("mixed"),)
    path.write_text(path.read_text().replace("bundled:mixed", "bundled:mixt"))
    assert run(["monitor", "--check", str(path)]) == 2
    assert "bundled:mixt: there is no such bundled recording; there are mixed" in capsys.readouterr().err
    assert run(["import", "bundled:step", "--to", str(tmp_path / "step.h5")]) == 0
