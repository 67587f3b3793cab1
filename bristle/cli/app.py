"""The console application: which commands there are, and how each kind of ending becomes an exit code."""

from __future__ import annotations

import importlib
import os
import signal
import sys
import threading
from collections.abc import Sequence
from typing import NoReturn

import typer

from recordings.errors import BadInput, BadParameter, NegativeAnswer

COMMANDS = {
    "demo": "demo",
    "evaluate": "evaluate",
    "fit": "fit",
    "import": "import_",
    "monitor": "monitor",
    "record": "record",
    "replay": "replay",
    "serve": "serve",
    "show": "show",
    "simulate": "simulate",
    "trace": "trace",
}
"""Command name -> module in `bristle.cli.commands`; each module has one function `command`."""

OPTIONS = {
    "column": "--column NAME=COLUMN:UNIT",
    "overwrite": "--force",
    "rate_hz": "--rate HZ",
    "time": "--time COLUMN:UNIT",
}
"""How a message writes the option that stands for a parameter, where it is not the parameter's name alone."""

SEVERAL = ("--holdout",)
"""Options that take all words up to the next option."""

INTERRUPTED = 130
AGAIN_S = 0.01
"""When an interrupt is given again that came where nothing can be raised [s]."""


def application() -> typer.Typer:
    """Build the Typer application with every command of `COMMANDS`."""
    app = typer.Typer(
        name="bristle",
        help="Learns what a control valve really does from measured data, then watches it.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
    )
    app.callback()(lambda: None)
    for name, module in COMMANDS.items():
        function = importlib.import_module(f"bristle.cli.commands.{module}").command
        app.command(name)(function)
    return app


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 done, 1 negative answer, 2 bad input or usage, 130 interrupted."""
    command = typer.main.get_command(application())
    try:
        code = command.main(args=_repeated(sys.argv[1:] if arguments is None else arguments), standalone_mode=False)
    except BadInput as error:
        return _say(_as_option(error), 2)
    except NegativeAnswer as answer:
        return _say(str(answer), 1)
    except (KeyboardInterrupt, typer.Abort):
        return _say("interrupted", INTERRUPTED)
    except Exception as error:
        return _usage(error)
    if code == INTERRUPTED:  # how the parser hands on a KeyboardInterrupt
        return _say("interrupted", INTERRUPTED)
    return code if isinstance(code, int) else 0


def _repeated(arguments: Sequence[str]) -> list[str]:
    """``--holdout A B`` as ``--holdout A --holdout B``: the parser would silently take B for a recording to fit."""
    spelled: list[str] = []
    option = None
    for word in arguments:
        if word.startswith("-"):
            option = word if word in SEVERAL else None
        elif option is not None and spelled[-1] != option:
            spelled.append(option)
        spelled.append(word)
    return spelled


def _usage(error: Exception) -> int:
    """A usage error of the option parser, in one line; anything else is a defect and keeps its traceback."""
    if not hasattr(error, "format_message"):
        raise error
    context = getattr(error, "ctx", None)
    helpful = f"; see '{context.command_path} --help'" if context else ""
    return _say(f"{' '.join(error.format_message().split())}{helpful}", 2)


def _as_option(error: BadInput) -> str:
    """What is wrong with an input, with the parameter it names written as the option of this command line."""
    if isinstance(error, BadParameter):
        (parameter,) = error.parameters
        return f"--{parameter.replace('_', '-')}{str(error).removeprefix(parameter)}"
    options = [OPTIONS.get(name, f"--{name.replace('_', '-')}") for name in error.parameters]
    return f"{error} ({', '.join(options)})" if options else str(error)


def _say(message: str, code: int) -> int:
    print(f"bristle: {message}", file=sys.stderr)
    return code


def _unraisable(event: sys.UnraisableHookArgs) -> None:
    """An interrupt that falls into a callback of the interpreter, a weak reference's for example, is not lost."""
    if issubclass(event.exc_type, KeyboardInterrupt):
        threading.Timer(AGAIN_S, os.kill, (os.getpid(), signal.SIGINT)).start()
    else:
        sys.__unraisablehook__(event)


def main() -> NoReturn:
    """Entry point of the console script."""
    sys.unraisablehook = _unraisable
    code = run()
    if code == INTERRUPTED:  # who presses again while the process ends must not change how it ends
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(code)
