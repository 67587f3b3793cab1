"""`bristle import` and `bristle show` as a user calls them."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from _page import Page
from dying_writer import values
from recording_samples import SPECS, contract_file

from bristle.cli.app import run
from recordings import Recording, RecordingWriter, Signal, read, write
from recordings.importers import import_file

Output = pytest.CaptureFixture[str]


def said(output: Output) -> tuple[str, str]:
    captured = output.readouterr()
    return captured.out, captured.err


@pytest.fixture
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("rig.csv").write_text("t;stem;thrust;note\n0;1,5;0,2;a\n10;2,0;0,25;b\n20;2,5;-0,3;c\n")
    return tmp_path


OPTIONS = ["--time", "t:ms", "--column", "position=stem:mm", "--column", "force=-2*thrust:kN:extra", "--decimal", ","]
UNNAMED = ["--no-header", "--skip-lines", "1", "--column", "position=2:mm", *OPTIONS[-2:]]


def test_a_table_becomes_a_recording(table: Path, capsys: Output) -> None:
    more = ["--plant", "stroke_m=0.04", "--title", "Rig 4", "--source", "rig"]
    assert run(["import", "rig.csv", "--to", "rig.h5", *OPTIONS, *more]) == 0
    out, err = said(capsys)
    assert out == "wrote rig.h5: 3 samples of time [s], position [m], force [N]\n"
    assert err == "bristle: columns without numbers were left out: note\n"
    made = read("rig.h5")
    np.testing.assert_allclose(made["force"].values, [-400, -500, 600])
    assert (made["force"].role, made.title, made.source, made.plant.stroke_m) == ("extra", "Rig 4", "rig", 0.04)


def test_an_existing_recording_is_replaced_only_by_force(table: Path, capsys: Output) -> None:
    Path("rig.h5").write_text("precious")
    assert run(["import", "rig.csv", "--to", "rig.h5", *OPTIONS]) == 2
    assert said(capsys)[1].startswith(
        "bristle: rig.h5: it exists already; choose another name, or allow overwriting (--f"
    )
    assert Path("rig.h5").read_text() == "precious"
    assert run(["import", "rig.csv", "--to", "rig.h5", *OPTIONS, "--force"]) == 0
    assert len(read("rig.h5")) == 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.csv", "--to", "a.h5"], "nowhere.csv: there is no such file; check the path"),
        (["rig.csv"], "Missing option '--to'"),
        (["rig.csv", "--to", "no/a.h5", *OPTIONS], "no/a.h5: the folder does not exist; make it first"),
        (["rig.csv", "--to", "a.h5"], "rig.csv: no column is known to be a signal; say which column is the position"),
        (["rig.csv", "--to", "a.h5"], "t, stem, thrust, note (--column NAME=COLUMN:UNIT)"),
        (["rig.csv", "--to", "a.h5", "--column", "position=1:mm"], "rig.csv: column 't': the unit of the time is not"),
        (["rig.csv", "--to", "a.h5", "--column", "position=1:mm"], "such as s, ms or min (--time COLUMN:UNIT)"),
        (
            ["rig.csv", "--to", "a.h5", *OPTIONS[:-2]],
            "rig.csv: row 2: '1,5' in column 'stem' is not a number; the decimal",
        ),
        (["rig.csv", "--to", "a.h5", *OPTIONS[:-2]], "here; where it is ',', say so (--decimal)"),
        (["rig.csv", "--to", "a.h5", *UNNAMED], "columns: 1, 2, 3, 4 (--time COLUMN:UNIT, --rate HZ)"),
        (["rig.csv", "--to", "a.h5", *OPTIONS, "--decimal", ";"], "options: file.decimal: Input should be '.' or ','"),
        (["rig.csv", "--to", "a.h5", *OPTIONS, "--rate", "5"], "time comes from a column or from a rate"),
        (["rig.csv", "--to", "a.h5", "--mapping", "emps"], "rig.csv: there is no column 'qm'; columns there: t, stem"),
        (
            ["rig.csv", "--to", "a.h5", "--mapping", "x.toml"],
            "x.toml: there is no such mapping; give a TOML file or one of",
        ),
    ],
)
def test_bad_usage_is_one_line_and_exit_2(table: Path, capsys: Output, arguments: list[str], words: str) -> None:
    code = run(["import", *arguments])
    out, err = said(capsys)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1
    assert not Path("a.h5").exists()


def test_a_recording_that_was_cut_off_is_rescued_into_another_file(
    tmp_path: Path, capsys: Output, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    writer = RecordingWriter("run.h5", SPECS)
    writer.append(values(100))
    files = {name: Path(name).read_bytes() for name in ("run.h5", "run.h5.journal")}
    assert run(["import", "run.h5", "--to", "new.h5"]) == 2
    assert "it is still being recorded; stop the recorder first" in said(capsys)[1]
    writer.close()
    Path("run.h5.journal").write_bytes(files["run.h5.journal"])
    for content in (files["run.h5"], files["run.h5"][:500], b""):
        Path("run.h5").write_bytes(content)
        assert run(["import", "run.h5", "--to", "new.h5", "--force"]) == 0
        np.testing.assert_array_equal(read("new.h5")["force"].values, np.arange(100))
        assert Path("run.h5").read_bytes() == content
        assert Path("run.h5.journal").exists()
    assert run(["import", "run.h5", "--to", "run.h5", "--force"]) == 2
    assert "run.h5: it is the file to import; choose another name" in said(capsys)[1]
    assert run(["show", "run.h5"]) == 2
    Path("run.h5.journal").write_bytes(b"torn")
    assert run(["import", "run.h5", "--to", "none.h5"]) == 2
    assert not list(Path().glob("none*"))
    Path("run.h5.journal").unlink()
    Path("run.h5").write_bytes(files["run.h5"])
    assert run(["import", "run.h5", "--to", "copy.h5"]) == 0
    assert len(read("copy.h5")) == 100


def test_show_says_what_is_in_a_recording(tmp_path: Path, capsys: Output) -> None:
    path = contract_file(tmp_path / "rec.h5")
    with h5py.File(path, "r+") as file:
        file["signals/time"][20:] += 1.0
        file["signals/force"][3:13] = np.nan
    assert run(["show", str(path)]) == 0
    out, err = said(capsys)
    assert err == ""
    for words in (
        f"{path}: recording of 40 samples over 1.39 s\nsteps, rig, 2026-11-21 09:30:00+01:00",
        "time from 0 s, every 0.01 s (100 Hz), in fact 0.01 to 1.01 s",
        "1 gaps of more than 5 steps, the longest 1.01 s, after 0.19 s",
        "position      output  mm",
        "stem; resolution 0.01; noise 0.003",
        "25 %",
        "gland_colour  extra   furlong",
        "stroke_m = 0.0381",
        "events: 1 note, 1 fault\n  0.1 s  note  começo",
        "operator = Ada",
        "a fit can predict the position from the force",
    ):
        assert words in out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"position": "input", "force": "output"}, "predict the force from the position (the motion drives)"),
        (
            {"force": None, "pressure": "input"},
            "a fit can predict the position from the pressure and the diaphragm area",
        ),
        ({"force": None}, "a fit needs a force or a pressure besides the position, which is not here"),
        ({"position": None}, "a fit needs a position, which is not here"),
    ],
)
def test_show_says_what_a_recording_is_good_for(
    tmp_path: Path, capsys: Output, change: dict[str, str | None], words: str
) -> None:
    path = contract_file(tmp_path / "rec.h5")
    with h5py.File(path, "r+") as file:
        for name, role in change.items():
            if role is None:
                del file[f"signals/{name}"]
            else:
                dataset = file["signals"].require_dataset(name, (40,), "f8")
                dataset.attrs.update({"role": role, "unit": {"position": "m", "force": "N"}.get(name, "Pa")})
    assert run(["show", str(path)]) == 0
    assert words in said(capsys)[0]


def test_show_lists_everything_that_is_wrong_and_ends_with_2(tmp_path: Path, capsys: Output) -> None:
    path = contract_file(tmp_path / "rec.h5")
    with h5py.File(path, "r+") as file:
        file["signals/force"].attrs["role"] = "cause"
        file["plant"].attrs["stroke_m"] = -1.0
    assert run(["show", str(path)]) == 2
    out, err = said(capsys)
    assert out.startswith("2 things are wrong:\n")
    assert "stroke_m is finite and positive" in out
    assert err.count("\n") == 1
    assert "the role is 'cause'; allowed: time, input, output, extra" in err


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.json", '{"format": "recipe"}', "a file of the kind 'recipe' cannot be shown; kinds: recording"),
        ("a.json", "{", "it is not JSON"),
    ],
)
def test_show_refuses_what_it_does_not_know(
    tmp_path: Path, capsys: Output, name: str, content: str, words: str
) -> None:
    (tmp_path / name).write_text(content)
    assert run(["show", str(tmp_path / name)]) == 2
    out, err = said(capsys)
    assert (out, err.count("\n")) == ("", 1)
    assert words in err


def test_show_says_what_an_import_would_make_of_a_file_of_another_program(tmp_path: Path, capsys: Output) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t [s],Stellweg [mm]\n0,1\n1,2\n")
    assert run(["show", str(path)]) == 0
    shown = said(capsys)[0]
    assert f"bristle import {path} --to a.h5" in shown
    assert "position" in shown
    assert run(["import", str(path), "--preview"]) == 0
    assert said(capsys)[0] == shown
    assert run(["show", str(path), "--plot", str(tmp_path / "a.html")]) == 2
    assert "import it first" in said(capsys)[1]


def test_the_picture_is_one_page_that_fetches_nothing(tmp_path: Path, capsys: Output) -> None:
    path, page = contract_file(tmp_path / "rec.h5"), tmp_path / "rec.html"
    with h5py.File(path, "r+") as file:
        file.attrs["title"] = "<script>alert(1)</script>"
    assert run(["show", str(path), "--plot", str(page)]) == 0
    assert f"wrote {page}" in said(capsys)[0]
    drawn = Page(page.read_text())
    assert drawn.title == "<script>alert(1)</script>"
    assert drawn.addresses == []
    assert not any(script.startswith("alert") for script in drawn.scripts)
    assert run(["show", str(path), "--plot", str(tmp_path / "no" / "rec.html")]) == 2
    assert "the folder does not exist" in said(capsys)[1]


def test_the_picture_of_a_long_recording_stays_small(tmp_path: Path, capsys: Output) -> None:
    n_samples = 60_000
    lines = "\n".join(f"{k},{k % 97}" for k in range(n_samples))
    (tmp_path / "long.csv").write_text("time [ms],position [mm]\n" + lines)
    write(tmp_path / "long.h5", import_file(tmp_path / "long.csv").recording)
    assert run(["show", str(tmp_path / "long.h5"), "--plot", str(tmp_path / "long.html")]) == 0
    empty = contract_file(tmp_path / "short.h5")
    assert run(["show", str(empty), "--plot", str(tmp_path / "short.html")]) == 0
    assert (tmp_path / "long.html").stat().st_size < (tmp_path / "short.html").stat().st_size + 150_000


def test_control_characters_of_a_file_never_reach_the_terminal(tmp_path, capsys):
    path = tmp_path / "escape\x1b[2J.h5"
    write(path, recording_with_title("\x1b]0;mine\x07 \x9b31m"))
    assert run(["show", str(path)]) == 0
    assert run(["show", str(path) + "\x1b[1m"]) == 2
    said = "".join(capsys.readouterr())
    assert "mine" in said
    assert all(letter == "\n" or letter.isprintable() for letter in said)


def recording_with_title(title: str) -> Recording:
    time = Signal("time", np.arange(4.0), "s", "time")
    return Recording.of([time, Signal("\x1b[31mred", np.arange(4.0), "m\x1b", "extra")], title=title)


@pytest.mark.parametrize("command", [["show"], ["import", "--to", "out.h5"], ["replay", "--model", "m.json"]])
def test_a_name_of_three_hundred_characters_is_one_line(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run([command[0], "x" * 300, *command[1:]]) == 2
    assert capsys.readouterr().err.count("\n") == 1
