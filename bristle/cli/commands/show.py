"""`bristle show`: what is in a file, in words or as a picture. A new kind of file is one line in `KINDS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from bristle.cli.terminal import plain_text


@dataclass(frozen=True)
class Kind:
    """How a kind of file is shown. words : text for the terminal; picture : a self-contained HTML page."""

    words: Callable[[Path], str]
    picture: Callable[[Path], str]


def _recording_words(file: Path) -> str:
    from recordings import BadInput, describe, validate

    try:
        return describe(file)
    except BadInput:
        problems = validate(file)
        if len(problems) > 1:
            print(plain_text("\n  ".join([f"{len(problems)} things are wrong:", *map(str, problems)])))
        raise


def _recording_picture(file: Path) -> str:
    from recordings import picture

    return picture(file)


def _map_words(file: Path) -> str:
    from hil import describe_register_map

    return describe_register_map(file)


def _map_picture(file: Path) -> str:
    from hil import register_map_page

    return register_map_page(file)


def _model_words(file: Path) -> str:
    from bristle.cli.console import model_words
    from simulator import ValveModel

    return model_words(ValveModel.read(file))


def _model_picture(file: Path) -> str:
    from recordings import BadInput

    raise BadInput(f"{file}: --plot", "a model alone has no picture", "use 'bristle fit --report' on its recordings")


def _trace_words(file: Path) -> str:
    from bristle.cli.tracing import trace_words

    return trace_words(file)


def _trace_picture(file: Path) -> str:
    from recordings import BadInput

    raise BadInput(f"{file}: --plot", "a trace alone has no picture", "use 'bristle trace --report' on its recordings")


KINDS: Mapping[str, Kind] = {
    "recording": Kind(_recording_words, _recording_picture),
    "register-map": Kind(_map_words, _map_picture),
    "valve-model": Kind(_model_words, _model_picture),
    "valve-trace": Kind(_trace_words, _trace_picture),
}
"""By what `kind_of` says: the `format` that a JSON file names, `register-map` for TOML, else `recording`."""


def command(
    file: Annotated[Path, typer.Argument(help="A recording, a model, a trace or a register map.")],
    plot: Annotated[Path | None, typer.Option(help="Write a picture to this HTML file.")] = None,
) -> None:
    """Say what is in a file; with --plot, draw it too.

    Examples:

    bristle show run.h5

    bristle show run.h5 --plot run.html
    """
    from recordings import BadInput, save_text

    name = kind_of(file)
    if name not in KINDS:
        raise BadInput(str(file), f"a file of the kind '{name}' cannot be shown", f"kinds: {', '.join(KINDS)}")
    print(plain_text(KINDS[name].words(file)))
    if plot is not None:
        save_text(plot, KINDS[name].picture(file))
        print(f"\nwrote {plot}")


def kind_of(file: Path) -> str:
    """What kind of file it is, a recording where it is nothing else. Raises BadInput for a .json that is no JSON."""
    if file.suffix == ".toml":
        return "register-map"
    from recordings import read_small_json

    content = read_small_json(file, "give a model, a trace or a recording") if file.suffix == ".json" else None
    return str(content.get("format")) if isinstance(content, dict) else "recording"
