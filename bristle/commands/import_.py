"""`bristle import`: a foreign file becomes a recording."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from recordings import BadInput

COLUMNS, LAYOUT, ABOUT = "Which column is what", "How the file is laid out", "What is known besides"


def command(
    file: Annotated[Path, typer.Argument(help="CSV, TSV (also .gz), MATLAB .mat, HDF5 or Parquet.", show_default=False)],
    to: Annotated[Path, typer.Option("--to", help="The recording to make.", show_default=False)],
    mapping: Annotated[
        str | None, typer.Option(help="A ready mapping by name, or a TOML file.", rich_help_panel=COLUMNS)
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=COLUMN[:UNIT[:ROLE]]; COLUMN is a name, a number from 1, or a formula such as gtau*vir.",
            rich_help_panel=COLUMNS,
        ),
    ] = None,
    time: Annotated[
        str | None, typer.Option(help="COLUMN[:UNIT]; the unit iso8601 reads dates.", rich_help_panel=COLUMNS)
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="Rows a second, when there is no column of time.", rich_help_panel=COLUMNS)
    ] = None,
    time_repair: Annotated[
        str | None, typer.Option(help="refuse, drop or sort rows whose time does not increase.", rich_help_panel=COLUMNS)
    ] = None,
    from_s: Annotated[float | None, typer.Option("--from", help="First time kept, s.", rich_help_panel=COLUMNS)] = None,
    until_s: Annotated[float | None, typer.Option("--until", help="Last time kept, s.", rich_help_panel=COLUMNS)] = None,
    separator: Annotated[
        str | None, typer.Option(help="auto, comma, semicolon, tab, space or a character.", rich_help_panel=LAYOUT)
    ] = None,
    decimal: Annotated[str | None, typer.Option(help="Decimal sign, . or ,", rich_help_panel=LAYOUT)] = None,
    thousands: Annotated[
        str | None, typer.Option(help="Sign between thousands, to be dropped.", rich_help_panel=LAYOUT)
    ] = None,
    header: Annotated[
        bool | None, typer.Option("--header/--no-header", help="Whether the first row holds names.", rich_help_panel=LAYOUT)
    ] = None,
    comment: Annotated[
        str | None, typer.Option(help="What a line to be skipped begins with; default #.", rich_help_panel=LAYOUT)
    ] = None,
    encoding: Annotated[
        str | None, typer.Option(help="Default: utf-8, else latin-1.", rich_help_panel=LAYOUT)
    ] = None,
    skip_lines: Annotated[int | None, typer.Option(help="Lines before the table.", rich_help_panel=LAYOUT)] = None,
    drop_rows: Annotated[int | None, typer.Option(help="Rows of data to drop first.", rich_help_panel=LAYOUT)] = None,
    missing: Annotated[
        list[str] | None, typer.Option(help="A text that means no value.", rich_help_panel=LAYOUT)
    ] = None,
    variable: Annotated[
        str | None, typer.Option(help="The matrix of a .mat file to take columns from.", rich_help_panel=LAYOUT)
    ] = None,
    plant: Annotated[
        list[str] | None, typer.Option(help="NAME=VALUE, such as stroke_m=0.0381.", rich_help_panel=ABOUT)
    ] = None,
    title: Annotated[str | None, typer.Option(help="One line for plots.", rich_help_panel=ABOUT)] = None,
    source: Annotated[str | None, typer.Option(help="plant, rig or simulated.", rich_help_panel=ABOUT)] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the recording if it is there.")] = False,
) -> None:
    """Make a recording of a file that another program wrote.

    Columns whose header says a known name and a unit, such as "position [mm]", need no option.

    Examples:

    bristle import rig.csv --to rig.h5 --time t:ms --column position=stem:mm --column force=thrust:kN

    bristle import DATA_EMPS.mat --to emps.h5 --mapping emps

    bristle import log.txt --to log.h5 --rate 100 --column "position=6.25*#2-25:%" --plant stroke_m=0.02

    bristle import cut-off.h5 --to whole.h5     (a recording whose recorder died)
    """
    layout = {
        "separator": separator,
        "decimal": decimal,
        "thousands": thousands,
        "header": header,
        "comment": comment,
        "encoding": encoding,
        "skip_lines": skip_lines,
        "drop_rows": drop_rows,
        "missing": missing,
        "variable": variable,
    }
    clock = {"rate_hz": rate, "repair": time_repair, "from_s": from_s, "until_s": until_s}
    from bristle.commands._import_options import changes_of, make

    changes = changes_of(column or [], time, plant or [], layout, clock, {"title": title, "source": source})
    for note in make(file, to, mapping, changes, overwrite=force):
        print(note, file=sys.stderr)
