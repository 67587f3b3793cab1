"""What every command has in common: --json, --quiet, --verbose, completion, and tables that cut nothing."""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
import sys
import time

import pytest

from bristle.cli.app import COMMANDS, run
from bristle.cli.output.working import _StageLines, working
from bristle.cli.several import spelled_out
from recordings import bundled_path

STEP = ("test", "bundled:step", "--kind", "step")


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_takes_the_common_options_and_its_help_cuts_nothing(console, name, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    shown = console(name, "--help").out
    assert "…" not in shown
    assert all(len(line) <= 80 for line in shown.splitlines())
    assert all(option in shown for option in ("--json", "--quiet", "--verbose"))


def test_json_is_the_file_and_nothing_else(console, tmp_path):
    out = tmp_path / "test.json"
    ending = console(*STEP, "--out", out, "--json")
    assert ending.code == 0
    assert json.loads(ending.out) == json.loads(out.read_text())
    assert console(*STEP, "--quiet").out == ""


@pytest.mark.parametrize(
    ("words", "code", "part"),
    [
        (["fit", "nowhere.h5"], 2, "no such file"),
        (["fit"], 2, "Missing argument"),
        (["bogus"], 2, "No such command"),
        (["compare", "bundled:step", "nowhere.h5"], 2, "no such file"),
    ],
)
def test_an_error_is_one_object_too(console, words, code, part):
    ending = console(*words, "--json")
    assert ending.code == code
    error = json.loads(ending.out)["error"]
    assert error["code"] == code
    assert part in error["message"]
    assert ending.complaint == error["message"]


def test_verbose_says_where_an_error_comes_from(console):
    ending = console("fit", "nowhere.h5", "--verbose")
    assert "Traceback" in ending.err[0] or any("Traceback" in line for line in ending.err)
    assert ending.err[-1].startswith("bristle: nowhere.h5")


def test_the_version_is_a_command_too(console):
    assert console("version").out == console("--version").out
    assert json.loads(console("version", "--json").out)["bristle"] in console("version").out


def test_completion_is_offered(console):
    shown = console("--help").out
    assert "--install-completion" in shown
    assert "--show-completion" in shown


@pytest.mark.parametrize(
    ("words", "spelled"),
    [
        ("fit a --holdout b c --out m", "fit a --holdout b --holdout c --out m"),
        ("fit --holdout c a", "fit --holdout c a"),
        ("fit --holdout c a b --out m", "fit --holdout c a b --out m"),
        ("fit --out m --holdout c a", "fit --out m --holdout c a"),
        ("fit --hold a --holdout b c", "fit --hold a --holdout b --holdout c"),
        ("fit --holdout b c --report-on d e", "fit --holdout b --holdout c --report-on d --report-on e"),
    ],
)
def test_an_option_that_takes_several_words_leaves_some_to_fit(words, spelled):
    assert spelled_out(words.split(), {"--hold"}) == spelled.split()


def test_every_file_can_be_shown(console, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    model = tmp_path / "compare.json"
    assert console("compare", "bundled:mixed", "bundled:step", "--out", model).code == 0
    assert console(*STEP, "--out", tmp_path / "test.json").code == 0
    (tmp_path / "e.jsonl").write_text('{"time": "2026", "valve": "A", "kind": "alarm", "text": "x"}\n')
    (tmp_path / "plant.toml").write_text('title = "a"\n[[source]]\naddress = "tcp://127.0.0.1"\n')
    shown = {
        "bundled:step": "recording of 10001 samples",
        str(bundled_path("step")): "recording of 10001 samples",
        "damadics": "downstream_pressure: device 1, input 6-7",
        "damadics-write": "a map for writing",
        str(model): "comparison of",
        str(tmp_path / "test.json"): "valve test: step",
        str(tmp_path / "e.jsonl"): "1 events: 1 alarm",
        str(tmp_path / "plant.toml"): "a plant file",
    }
    for name, words in shown.items():
        ending = console("show", name)
        assert (ending.code, ending.err) == (0, []), ending.err
        assert words in ending.out
        assert "…" not in ending.out
        assert json.loads(console("show", name, "--json").out)
    (tmp_path / "a.txt").write_text("t x\n1 2\n")
    assert "to import it" in console("show", tmp_path / "a.txt").out
    assert "no such file" in console.refused("show", tmp_path / "none.xlsx")


@pytest.mark.parametrize("words", [STEP, ("compare", "bundled:mixed", "bundled:step")])
def test_tables_fit_80_columns(console, monkeypatch, words):
    monkeypatch.setenv("COLUMNS", "80")
    out = console(*words).out
    rows = [line for line in out.splitlines() if "──" in line]
    assert all(len(line) <= 80 for line in rows)
    assert "…" not in out


def test_tables_keep_names_whole(monkeypatch):
    from bristle.cli.output.tables import in_lines, words_table

    name = "position_dependent_friction"
    rows = [(name, "1.234e+05", "12.3", "0.000123", "does not do better on the recordings set aside [m2]")]
    heads = ("effect", "gain", "held-out t", "held-out rmse [m]", "outcome")
    lines = in_lines(words_table(heads, rows), 80)
    assert any(name in line for line in lines)
    assert max(map(len, lines)) <= 80
    assert "[m2]" in "".join(lines)
    assert "…" not in "".join(lines)


def test_work_that_lasts_says_its_stages_in_lines(capsys, monkeypatch):
    passed = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: passed[0])
    lines = _StageLines("fitting", 2.0, 2.0)
    lines.report("starting values", 1, 5)
    assert capsys.readouterr().err == ""
    for now, stage, done in (
        (2.5, "starting values", 3),
        (3.0, "refitting", 0),
        (4.6, "refitting", 1),
        (6.0, "refitting", 2),
    ):
        passed[0] = now
        lines.report(stage, done, 5)
    assert capsys.readouterr().err.splitlines() == [
        "fitting: starting values: 3 of 5 (2 s)",
        "fitting: refitting: 1 of 5 (5 s)",
    ]


def test_a_line_says_what_is_left_of_the_budget(capsys, monkeypatch):
    passed = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: passed[0])
    lines = _StageLines("tracing", 2.0, 2.0, budget=120.0)
    for passed[0] in (23.4, 150.0):
        lines.report(f"round 1: score test at {passed[0]:.0f}", 2, 8)
    assert capsys.readouterr().err.splitlines() == [
        "tracing: round 1: score test at 23: 2 of 8 (23 s, 97 s left)",
        "tracing: round 1: score test at 150: 2 of 8 (150 s, 0 s left)",
    ]


def test_on_a_terminal_the_time_that_is_left_goes_on_while_a_stage_lasts():
    pty = pytest.importorskip("pty")
    program = """
import sys
from bristle.cli.output.working import working
with working("tracing", budget=9.0) as progress:
    progress("a long fit", 0, 0)
    sys.stdin.read()
"""
    ours, theirs = pty.openpty()
    command, shown, wanted = [sys.executable, "-c", program], b"", {b"8 s left", b"7 s left"}
    with subprocess.Popen(
        command, env=os.environ | {"TERM": "xterm"}, stdin=subprocess.PIPE, stderr=theirs
    ) as work:  # fmt: skip
        os.close(theirs)
        late = time.monotonic() + 60.0
        with contextlib.suppress(OSError):  # the end of a terminal
            while some := os.read(ours, 4096):
                shown += some
                if wanted <= set(re.findall(rb"\d s left", shown)) or time.monotonic() > late:
                    work.stdin.close()  # the stage is over
    os.close(ours)
    assert work.returncode == 0
    assert wanted <= set(re.findall(rb"\d s left", shown))
    assert b"a long fit" in shown


def test_quick_work_says_nothing(capsys):
    run(["version"])
    capsys.readouterr()
    with working("looking") as progress:
        progress("everything", 1, 1)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    "words",
    [
        "assess {}",
        "test {} --kind step",
        "test --simulate --kind rowing",
        "compare {} bundled:step",
        "compare bundled:step model.json",
    ],
)
def test_a_refusal_is_one_line_however_slow_the_machine_is(words, console, tmp_path, monkeypatch):
    monkeypatch.setattr("bristle.cli.output.working.SOON_S", 0.0)  # every line that may come comes
    table = tmp_path / "table.csv"
    table.write_text("time,SP,PV,OP\n" + "".join(f"{k},50,50.{k % 10},30\n" for k in range(500)))
    ended = console(*words.format(table).split())
    assert (ended.code, ended.out) == (2, "")
    assert ended.complaint
