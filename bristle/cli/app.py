"""The console application: which commands there are, and how each kind of ending becomes an exit code."""

from __future__ import annotations

import importlib
import os
import signal
import sys
import threading
import traceback
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from typer.core import TyperArgument, TyperCommand, TyperOption

from bristle.cli.output.common import with_common_options
from bristle.cli.output.manner import OPTIONS as SPOKEN
from bristle.cli.output.manner import answer, begin, manner, say
from bristle.cli.output.parameters import option, shown_option
from bristle.cli.output.terminal import plain_text
from bristle.cli.several import spelled_out

if TYPE_CHECKING:
    from recordings.errors import BadInput

COMMANDS = {
    "assess": "plant_data.assess",
    "compare": "compare",
    "demo": "demo",
    "evaluate": "evaluate",
    "export": "export",
    "fit": "fit",
    "fleet": "fleet",
    "follow": "plant_data.follow",
    "import": "import_",
    "monitor": "monitor",
    "next-test": "plant_data.next_test",
    "probe": "look.probe",
    "record": "record",
    "replay": "replay",
    "serve": "serve",
    "show": "show",
    "simulate": "simulate",
    "test": "plant_data.test",
    "trace": "trace",
    "version": "look.version",
}
"""Command name -> module in `bristle.cli.commands`, with a dot in a folder of it; each has one function `command`."""

UNIX = ("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty")
"""Modules that Python does not have everywhere; recording, serving and fleets are built on them."""

INTERRUPTED = 130
AGAIN_S = 0.01
"""When an interrupt is given again that came where nothing can be raised [s]."""


def application() -> typer.Typer:
    """Build the Typer application with every command of `COMMANDS`."""
    app = typer.Typer(
        name="bristle",
        help="Learns what a control valve really does from measured data, then watches it.",
        context_settings={"help_option_names": ["-h", "--help"]},
        pretty_exceptions_enable=False,
    )
    app.callback()(_options)
    for name, module in COMMANDS.items():
        function = importlib.import_module(f"bristle.cli.commands.{module}").command
        app.command(name, cls=Literal)(with_common_options(function))
    return app


def _print_version(asked: bool) -> None:
    if asked:
        import bristle

        say(f"bristle {bristle.__version__}")
        answer({"bristle": bristle.__version__})
        raise typer.Exit


def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help=SPOKEN["--json"])] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help=SPOKEN["--quiet"])] = False,
    verbose: Annotated[bool, typer.Option("--verbose", help=SPOKEN["--verbose"])] = False,
) -> None:
    """What may stand before a command."""


class Literal(TyperCommand):
    """A command whose help is printed as it is written: the terminal's library would take ``[m2]`` for markup."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the help, once in the life of a command: its texts are changed."""
        from rich.markup import escape

        for parameter in self.params:
            if isinstance(parameter, TyperOption | TyperArgument):
                parameter.help = escape(parameter.help or "")
        super().format_help(ctx, formatter)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 done, 1 negative answer, 2 bad input or usage, 130 interrupted."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    spoken = begin(given)
    command = typer.main.get_command(application())
    words = spelled_out(given, _flags(command)) or ["--help"]
    try:
        code = command.main(args=words, prog_name="bristle", standalone_mode=False, obj=tuple(words))
    except (KeyboardInterrupt, typer.Abort):
        return _ended("interrupted", INTERRUPTED)
    except Exception as error:
        if spoken.verbose:
            traceback.print_exception(error)
        return _failed(error)
    if code == INTERRUPTED:  # how the parser hands on a KeyboardInterrupt
        return _ended("interrupted", INTERRUPTED)
    spoken.print_result()
    return code if isinstance(code, int) else 0


def _flags(command: Any) -> set[str]:
    """The options of all commands that take no word."""
    options = (one for sub in command.commands.values() for one in sub.params if getattr(one, "is_flag", False))
    return {word for one in options for word in (*one.opts, *one.secondary_opts)} | {"-h", "--help"}


def _failed(error: Exception) -> int:
    """The exit code of a command that an error ended, with its line; a defect keeps its traceback."""
    from recordings.errors import BadInput, LinkError, NegativeAnswer  # loads numpy: not for help alone

    if isinstance(error, BadInput):
        return _ended(_as_option(error), 2, where=error.where, found=error.found, remedy=error.remedy)
    if isinstance(error, NegativeAnswer | LinkError):
        return _ended(str(error), 1)
    if isinstance(error, OSError) and error.filename is not None:  # a name that is too long, a folder on the way
        return _ended(f"{error.filename}: {error.strerror}; check the path", 2)
    if isinstance(error, ModuleNotFoundError) and error.name in UNIX:
        return _ended(f"this needs Linux: Python has no module {error.name} here; see the README", 2)
    return _usage(error)


def _usage(error: Exception) -> int:
    """A usage error of the option parser, in one line; anything else is a defect and keeps its traceback."""
    if not hasattr(error, "format_message"):
        raise error
    context = getattr(error, "ctx", None)
    helpful = f"; see '{context.command_path} --help'" if context else "; see 'bristle --help'"
    said = " ".join(error.format_message().split()).removesuffix(".")
    return _ended(f"{said}{helpful}", 2)


def _as_option(error: BadInput) -> str:
    """What is wrong with an input, with the parameter it names written as the option of this command line."""
    from recordings.errors import BadParameter

    if isinstance(error, BadParameter):
        (name,) = error.parameters
        return f"{option(name)}{str(error).removeprefix(name)}"
    shown = ", ".join(shown_option(name) for name in error.parameters)
    return f"{error} ({shown})" if shown else str(error)


def _ended(message: str, code: int, **parts: str) -> int:
    """The line on stderr, and with ``--json`` the object on stdout: what there is of a result, else the error."""
    print(f"bristle: {plain_text(message)}", file=sys.stderr)
    manner().print_result({"code": code, "message": message, **parts})
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
