"""`bristle show`: what is in a file, in words, as a picture or as JSON. A new kind of file is an entry of `KINDS`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    file: Annotated[
        str,
        typer.Argument(
            help="A recording, any result (.json), events (.jsonl), a register map, a mapping, a plant file; "
            "bundled:NAME or the name of a shipped map. Of a file of another program, what an import would make of it."
        ),
    ],
    plot: Annotated[Path | None, typer.Option(help="Write a picture to this HTML file.")] = None,
) -> None:
    """Say what is in a file; with --plot, draw it too.

    Examples:

    bristle show run.h5 --plot run.html

    bristle show bundled:step

    bristle show damadics
    """
    from bristle.cli.output.manner import answer, say
    from bristle.cli.shown import KINDS, kind_of
    from bristle.cli.sources import shown_file
    from recordings import BadInput, save_text

    path = shown_file(file)
    name = kind_of(path)
    if name == "foreign":
        _foreign(path, plot)
        return
    if name not in KINDS:
        raise BadInput(file, f"a file of the kind '{name}' cannot be shown", f"kinds: {', '.join(KINDS)}")
    kind = KINDS[name]
    say(kind.words(path))
    answer(kind.facts(path))
    if plot is None:
        return
    if kind.picture is None:
        raise BadInput(f"{file}: --plot", f"a {name} alone has no picture", kind.instead)
    save_text(plot, kind.picture(path))
    say(f"\nwrote {plot}")


def _foreign(path: Path, plot: Path | None) -> None:
    """What an import would make of a file of another program."""
    from bristle.cli.shown.preview import show_preview
    from recordings import BadInput

    if plot is not None:
        raise BadInput(f"{path}: --plot", "it is not a file of Bristle", "import it first: bristle import --preview")
    show_preview(path, None, {})
