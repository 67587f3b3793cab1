"""The console as a whole: help, usage errors, exit codes, interruption."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
import typer

from bristle.cli.app import COMMANDS, application
from recordings import BadInput, NegativeAnswer

HOUSE = Path(__file__).resolve().parents[2]


def started(*arguments: str, folder: Path) -> subprocess.Popen[str]:
    """`python -m bristle ...` in a process of its own, in another folder than the house."""
    environment = os.environ | {"PYTHONPATH": str(HOUSE), "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(
        [sys.executable, "-m", "bristle", *arguments],
        cwd=folder, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_has_help_with_an_example(console, name):
    ending = console(name, "--help")
    assert ending.code == 0
    assert ending.err == []
    assert f"bristle {name} " in ending.out
    assert "Usage:" in ending.out


def test_the_help_lists_every_command(console):
    ending = console("--help")
    assert ending.code == 0
    assert all(name in ending.out for name in COMMANDS)


def test_bare_it_says_what_there_is(console):
    assert console() == console("--help")
    assert console().code == 0


@pytest.mark.parametrize("arguments", [(), *((name,) for name in sorted(COMMANDS))])
def test_a_short_option_asks_for_help_too(console, arguments):
    assert console(*arguments, "-h") == console(*arguments, "--help")


def test_the_version_is_one_line(console):
    ending = console("--version")
    assert (ending.code, ending.out, ending.err) == (0, f"bristle {version('bristle')}\n", [])


HELP: dict[str, str] = {}
"""What a command's help prints, by its name: it is drawn once for all options."""


def options() -> list[tuple[str, str]]:
    """Command and help text of every option and argument."""
    commands = typer.main.get_command(application()).commands
    return [(name, one.help) for name, command in commands.items() for one in command.params if one.help]


@pytest.mark.parametrize(("name", "text"), options())
def test_the_help_of_an_option_is_printed_as_it_is_written(console, monkeypatch, name, text):
    monkeypatch.setenv("COLUMNS", "400")  # so that no text is broken into lines
    if name not in HELP:
        HELP[name] = console(name, "--help").out
    assert text in HELP[name]


def test_some_help_has_units_in_brackets():
    assert sum("[m2]" in text for _, text in options()) >= 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["bogus"], "bogus"),
        (["fit"], "Missing argument"),
        (["fit", "bundled:step", "--bogus"], "--bogus"),
        (["simulate"], "--to"),
        (["simulate", "--to", "a.h5", "--rate", "fast"], "--rate"),
        (["simulate", "--to", "a.h5", "--seed", "-1"], "--seed"),
        (["--bogus"], "--bogus"),
    ],
)
def test_a_usage_error_is_one_line_with_a_hint(console, arguments, words):
    complaint = console.refused(*arguments)
    assert words in complaint
    assert "--help" in complaint


@pytest.mark.parametrize(
    ("problem", "code", "line"),
    [
        (BadInput("a.h5: force", "it is empty", "record again"), 2, "a.h5: force: it is empty; record again"),
        (NegativeAnswer("the fit did not converge"), 1, "the fit did not converge"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)  # fmt: skip
def test_every_kind_of_ending_has_its_code_and_its_line(console, monkeypatch, problem, code, line):
    def fail(*_, **__):
        raise problem

    monkeypatch.setattr("identification.identify", fail)
    ending = console("fit", "bundled:step")
    assert ending.code == code
    assert ending.complaint == line


def test_a_defect_keeps_its_traceback(console, monkeypatch):
    def fail(*_, **__):
        raise ZeroDivisionError("a defect")

    monkeypatch.setattr("identification.identify", fail)
    with pytest.raises(ZeroDivisionError):
        console("fit", "bundled:step")


@pytest.mark.parametrize(
    ("arguments", "code"),
    [(["--help"], 0), (["fit", "nowhere.h5"], 2), (["bogus"], 2)],
)
def test_the_process_ends_with_the_same_code(tmp_path, arguments, code):
    process = started(*arguments, folder=tmp_path)
    _, err = process.communicate(timeout=120)
    assert "Traceback" not in err
    assert process.returncode == code
    assert len(err.splitlines()) == (1 if code else 0)


@pytest.mark.slow
def test_ctrl_c_ends_a_fit_with_130_and_one_line(tmp_path):
    process = started("demo", "--out", "here", folder=tmp_path)
    assert process.stdout is not None
    assert any("Fitting bundled recordings" in line for line in process.stdout)
    ended = False
    while not ended:  # a library that is just being imported may swallow an interrupt: a user presses again
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=10.0)
        ended = process.poll() is not None
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "bristle: interrupted"
    assert "Traceback" not in err


SWALLOWED = """
import signal, sys, time, weakref
import identification
from bristle.cli import main

class Kept: ...

def fit(*_, **__):
    one = Kept()
    seen = weakref.ref(one, lambda _: signal.raise_signal(signal.SIGINT))
    del one
    time.sleep(60)

identification.identify = fit
sys.argv = ["bristle", "fit", "bundled:step"]
main()
"""


def test_an_interrupt_in_a_callback_of_the_interpreter_is_not_lost():
    environment = os.environ | {"PYTHONPATH": str(HOUSE)}
    command = [sys.executable, "-c", SWALLOWED]
    ended = subprocess.run(command, env=environment, text=True, capture_output=True, timeout=50)
    assert ended.returncode == 130
    assert ended.stderr == "bristle: interrupted\n"
