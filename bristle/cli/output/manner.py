"""How one run of the command line speaks: in words, as one JSON object, or not at all.

Commands use `say`, `note`, `answer` and `stdout` and need not know which of the options was given.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from bristle.cli.output.terminal import plain_text

if TYPE_CHECKING:
    from rich.console import Console

OPTIONS: Mapping[str, str] = {
    "--json": "Print the result as one JSON object and nothing else on stdout.",
    "--quiet": "Say nothing but errors.",
    "--verbose": "Say each stage with its time, and where an error comes from.",
}
"""What every command takes, and its help."""


@dataclass
class Manner:
    """json, quiet, verbose : the options; given : the words of the command line; result : what `answer` was given,
    printed when the command has ended.
    """

    json: bool = False
    quiet: bool = False
    verbose: bool = False
    given: tuple[str, ...] = ()
    result: Mapping[str, Any] | None = None

    @classmethod
    def of(cls, words: Sequence[str]) -> Manner:
        """The manner that the words of a command line ask for, wherever they stand before a ``--``.

        >>> Manner.of(["fit", "--json", "a.h5"]).json, Manner.of(["fit", "--", "--json"]).json
        (True, False)
        """
        options = words[: words.index("--")] if "--" in words else words
        return cls("--json" in options, "--quiet" in options, "--verbose" in options, tuple(words))

    @property
    def words(self) -> bool:
        """Whether words belong on stdout."""
        return not (self.json or self.quiet)

    def print_result(self, error: Mapping[str, Any] | None = None) -> None:
        """The one JSON object of this run: its result, else what went wrong. Nothing without ``--json``, nor where
        there is neither: a command that prints JSON of its own.
        """
        shown = self.result if self.result is not None else {"error": error} if error else None
        if self.json and shown is not None:
            from recordings import json_text

            print(json_text(shown), flush=True)


_CURRENT: ContextVar[Manner] = ContextVar("manner")


def manner() -> Manner:
    """How this run speaks."""
    return _CURRENT.get(None) or Manner()


def begin(words: Sequence[str]) -> Manner:
    """Begin a run with the words of its command line."""
    chosen = Manner.of(words)
    _CURRENT.set(chosen)
    return chosen


def say(*lines: str) -> None:
    """Words of the result on stdout; nothing with ``--json`` or ``--quiet``."""
    if manner().words:
        for line in lines:
            print(plain_text(line), flush=True)


def note(*lines: str) -> None:
    """What is worth knowing besides the result, on stderr; nothing with ``--quiet``."""
    if not manner().quiet:
        for line in lines:
            print(plain_text(line), file=sys.stderr, flush=True)


def answer(content: Mapping[str, Any]) -> None:
    """The result as it would stand in a file. ``--json`` prints it when the command has ended."""
    manner().result = content


class Reported(Protocol):
    """A result that is told in lines, written to a file and shown on a page."""

    def lines(self) -> list[str]: ...

    def as_json(self) -> dict[str, Any]: ...

    def write(self, path: Path) -> None: ...

    def report(self, path: Path) -> None: ...


def present(found: Reported, out: Path | None, report: Path | None) -> None:
    """A result in lines, as the answer of the command, and in the files that were asked for. Raises BadInput."""
    say(*found.lines())
    answer(found.as_json())
    if out:
        found.write(out)
    if report:
        found.report(report)


def stdout() -> Console:
    """The console for words of the result; it is mute with ``--json`` or ``--quiet``."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=True, quiet=not manner().words)
