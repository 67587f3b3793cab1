"""`bristle import`: a foreign file becomes a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

Text = str | None
Texts = list[str] | None
CellNumber = float | None


def _column(words: str, *names: str) -> Any:
    return typer.Option(*names, help=words, rich_help_panel="Which column is what")


def _layout(words: str, *names: str) -> Any:
    return typer.Option(*names, help=words, rich_help_panel="How the file is laid out")


def _about(words: str, *names: str) -> Any:
    return typer.Option(*names, help=words, rich_help_panel="What is known besides")


def command(
    file: Annotated[Path, typer.Argument(help="CSV, TSV (also .gz), Excel, MATLAB .mat, HDF5 or Parquet.")],
    to: Annotated[Path | None, typer.Option(help="The recording to make; needed but for --preview.")] = None,
    preview: Annotated[
        bool, typer.Option("--preview", help="Only look: columns, units, times, and the command to type.")
    ] = False,
    mapping: Annotated[Text, _column("A ready mapping by name, or a TOML file.")] = None,
    column: Annotated[
        Texts, _column("NAME=COLUMN[:UNIT[:ROLE]]; a name, a number from 1, or a formula: gtau*vir.")
    ] = None,
    time: Annotated[Text, _column("COLUMN[:UNIT]; dates are recognised.")] = None,
    time_format: Annotated[
        Text, _column("How dates are written: iso8601, day-first, month-first, or as %d.%m.%Y %H:%M:%S,%f.")
    ] = None,
    rate: Annotated[CellNumber, _column("Rows a second, where no column holds the time.")] = None,
    time_repair: Annotated[Text, _column("refuse, drop or sort rows whose time does not increase.")] = None,
    from_s: Annotated[CellNumber, _column("First time to keep, in s.", "--from")] = None,
    until_s: Annotated[CellNumber, _column("Last time to keep, in s.", "--until")] = None,
    separator: Annotated[Text, _layout("auto, comma, semicolon, tab, space or one character.")] = None,
    decimal: Annotated[Text, _layout("Decimal sign: . or ,")] = None,
    thousands: Annotated[Text, _layout("Sign between thousands, to be dropped.")] = None,
    header: Annotated[bool | None, _layout("Whether the first row holds names.", "--header/--no-header")] = None,
    comment: Annotated[Text, _layout("What a line to be skipped begins with; # when not given.")] = None,
    encoding: Annotated[Text, _layout("utf-8, else latin-1, when not given.")] = None,
    skip_lines: Annotated[int | None, _layout("Lines before the table.")] = None,
    drop_rows: Annotated[int | None, _layout("Rows of numbers to drop from the start.")] = None,
    missing: Annotated[Texts, _layout("A text that stands for no value.")] = None,
    variable: Annotated[Text, _layout("The matrix of a .mat file, or the sheet of an Excel file.")] = None,
    plant: Annotated[Texts, _about("NAME=VALUE, such as stroke_m=0.0381; the unit ends the name.")] = None,
    title: Annotated[Text, _about("One line for plots and reports.")] = None,
    source: Annotated[Text, _about("plant, rig or simulated.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the recording if it is there.")] = False,
) -> None:
    """Make a recording of a file that another program wrote.

    Columns whose header says a known name and a unit, such as "position (mm)", need no option. Examples:

    bristle import rig.csv --preview

    bristle import rig.csv --to rig.h5 --time t:ms --column position=stem:mm --column force=thrust:kN

    bristle import DATA_EMPS.mat --to emps.h5 --mapping emps

    bristle import log.txt --to log.h5 --rate 100 --column "position=6.25*#2-25:%" --plant stroke_m=0.02

    bristle import cut-off.h5 --to whole.h5 (puts a recording right whose recorder died)
    """
    from bristle.cli.import_options import clock_of, plant_of, signals_of
    from bristle.cli.output.manner import answer, note, say
    from bristle.cli.output.working import working
    from bristle.cli.shown.preview import show_preview
    from recordings import BadInput, file_of, open_recording
    from recordings.importers import import_to

    file_layout: dict[str, Any] = {"separator": separator, "decimal": decimal, "thousands": thousands, "header": header}
    file_layout |= {"comment": comment, "encoding": encoding, "skip_lines": skip_lines, "drop_rows": drop_rows}
    file_layout |= {"missing": missing, "variable": variable}
    clock = {
        "rate_hz": rate,
        "repair": time_repair,
        "format": time_format,
        "from_s": from_s,
        "until_s": until_s,
    } | clock_of(time)
    changes = {"title": title, "source": source, "file": file_layout, "time": clock}
    changes |= {"signals": signals_of(column or ()), "plant": plant_of(plant or ())}
    if preview:
        show_preview(file_of(file), mapping, changes)
        return
    if to is None:
        raise BadInput(
            "Missing option '--to'", "no recording to make is named", "give --to REC.h5, or --preview to look"
        )
    with working("importing"):
        notes = import_to(file_of(file), to, mapping, changes, overwrite=force)
    note(*(f"bristle: {sentence}" for sentence in notes))
    with open_recording(to) as made:
        labels = ", ".join(spec.label for spec in made.header.signals)
        answer({"file": to, "samples": len(made), "signals": list(made.specs), "notes": list(notes)})
        say(f"wrote {to}: {len(made)} samples of {labels}")
