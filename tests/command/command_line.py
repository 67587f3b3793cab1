"""Runs the console in this process and says what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pytest

from bristle.cli.app import run


@dataclass(frozen=True)
class Ending:
    """How a command ended: exit code, what it wrote to stdout, its lines on stderr."""

    code: int
    out: str
    err: list[str]

    @property
    def complaint(self) -> str:
        """The one line on stderr that a refusal or a negative answer must have."""
        assert len(self.err) == 1, self.err
        assert self.err[0].startswith("bristle: ")
        return self.err[0].removeprefix("bristle: ")


class Console:
    """The console of a user: `console("fit", "rec.h5")`."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def __call__(self, *arguments: object) -> Ending:
        self._capsys.readouterr()
        words: Sequence[str] = [str(argument) for argument in arguments]
        code = run(words)
        out, err = self._capsys.readouterr()
        return Ending(code, out, err.splitlines())

    def refused(self, *arguments: object) -> str:
        """The complaint of a command that must end with code 2 and nothing on stdout."""
        ending = self(*arguments)
        assert ending.code == 2
        assert ending.out == ""
        return ending.complaint
