"""Every error that the house raises on purpose, as one tree to catch at the level one can handle.

::

    BristleError                 everything below
    ├── BadInput                 something given cannot be used: a file, an item in it, an address  (exit code 2)
    │   └── BadParameter         the same of a parameter of a call: its name and its value
    ├── NegativeAnswer           the work was done and the answer is negative                       (exit code 1)
    └── LinkError                the way to a device failed or went away
        └── ProtocolError        the device answers, but not as its protocol has it

A command that ends with an error returns its exit code. A link that comes back is an event, not an error.
"""

from __future__ import annotations

from typing import Any

_LONGEST = 600
"""Characters of each part of a message."""


class BristleError(Exception):
    """The base of every error that is raised on purpose.

    >>> from recordings import read
    >>> try:
    ...     read("nowhere.h5")
    ... except BristleError as error:
    ...     print(error)
    nowhere.h5: there is no such file; check the path
    """


class BadInput(BristleError, ValueError):
    """Something that was given cannot be used; the command line prints it as one line and exits with 2.

    Parameters
    ----------
    where : str
        File and item, most general first: ``"rec.h5: /signals/time"``.
    found : str
        What is there.
    remedy : str
        What is allowed, or what to do.
    parameter : str or tuple of str, optional
        The parameter of the call that would mend it, or several, or the function that would. The command line adds the
        options of these names, and the command.

    >>> str(BadInput("rec.h5: /signals/time", "the time goes backwards at sample 7", "sort the rows by time"))
    'rec.h5: /signals/time: the time goes backwards at sample 7; sort the rows by time'
    """

    def __init__(self, where: str, found: str, remedy: str, *, parameter: str | tuple[str, ...] | None = None) -> None:
        self.where, self.found, self.remedy, self.parameter = where, found, remedy, parameter
        super().__init__(" ".join(f"{_short(where)}: {_short(found)}; {_short(remedy)}".split()))

    @property
    def parameters(self) -> tuple[str, ...]:
        """The parameters that would mend it; empty where none would."""
        return (self.parameter,) if isinstance(self.parameter, str) else self.parameter or ()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by the parts, so that a worker process can send it home."""
        return _bad_input, (self.where, self.found, self.remedy, self.parameter)


def _short(text: str) -> str:
    """A text without its middle where it is immense: a file may name anything anything."""
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} ... {text[-_LONGEST // 4 :]}"


class BadParameter(BadInput):
    """A parameter of a call has a value that cannot be used. The command line writes the parameter as its option.

    Parameters
    ----------
    parameter : str
        Name of the parameter: ``"given"``.
    value : object
        What was given for it, or the part of it that is wrong.
    found, remedy : str
        As in `BadInput`.

    >>> str(BadParameter("given", "mass.q", "there is no such parameter", "there is mass.m"))
    'given mass.q: there is no such parameter; there is mass.m'
    """

    def __init__(self, parameter: str, value: object, found: str, remedy: str) -> None:
        super().__init__(f"{parameter} {value}".strip(), found, remedy, parameter=parameter)
        self.value = value

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by the parts, so that a worker process can send it home."""
        return type(self), (self.parameter, self.value, self.found, self.remedy)


def _bad_input(where: str, found: str, remedy: str, parameter: str | tuple[str, ...] | None) -> BadInput:
    return BadInput(where, found, remedy, parameter=parameter)


class NegativeAnswer(BristleError):
    """The work was done and the answer is negative; the command line prints it and exits with 1.

    >>> issubclass(NegativeAnswer, BristleError), issubclass(NegativeAnswer, BadInput)
    (True, False)
    """


class LinkError(BristleError):
    """The way to a device failed, went away, or cannot be kept up.

    It may be back later, so a program that polls goes on:

    >>> try:
    ...     raise LinkError("tcp://127.0.0.1:502: connection refused")
    ... except LinkError as error:
    ...     print(f"nothing is known: {error}")
    nothing is known: tcp://127.0.0.1:502: connection refused
    """


class ProtocolError(LinkError):
    """A device answers, but not as its protocol has it.

    >>> issubclass(ProtocolError, LinkError)
    True
    """


def not_installed(where: str, work: str, library: str, extra: str, otherwise: str = "") -> BadInput:
    """The error of work that needs a library of an extra.

    where, work : what was asked for; library : as its package is called; otherwise : what could be done without it.

    >>> print(not_installed("a.xlsx", "reading Excel", "openpyxl", "excel"))
    a.xlsx: reading Excel needs the package openpyxl, which is not installed; install Bristle with its extra 'excel'
    """
    found = f"{work} needs the package {library}, which is not installed"
    remedy = f"install Bristle with its extra '{extra}'"
    return BadInput(where, found, f"{remedy}, or {otherwise}" if otherwise else remedy)
