"""The options that every command takes besides its own, added in one place."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, get_type_hints

import typer

from bristle.cli.output.manner import OPTIONS

PANEL = "What it says"


def with_common_options(function: Callable[..., None]) -> Callable[..., None]:
    """A command that takes `OPTIONS` as well. They are read from the words of the command line by `Manner.of`, before
    any of them is parsed, so that a mistake in another option is told in the right manner, too.
    """
    added = {option.removeprefix("--") + "_": _flag(option, words) for option, words in OPTIONS.items()}

    @functools.wraps(function)
    def told(**arguments: Any) -> None:
        function(**{name: value for name, value in arguments.items() if name not in added})

    hints = get_type_hints(function, include_extras=True)
    own = inspect.signature(function)
    given = [one.replace(annotation=hints[name]) for name, one in own.parameters.items()]
    flags = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=annotation)
        for name, annotation in added.items()
    ]
    told.__signature__ = own.replace(parameters=[*given, *flags])  # type: ignore[attr-defined]
    told.__annotations__ = hints | added
    return told


def _flag(option: str, words: str) -> Any:
    return Annotated[bool, typer.Option(option, help=words, rich_help_panel=PANEL)]
