"""A loop from a recording or from a historian's file: which column is SP, PV, OP and time."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from identification.loops.loop import LOOP_KINDS, ControlLoop, LoopKind, loop_of
from recordings import Array, BadInput, BadParameter, Recording
from recordings.importers import (
    ForeignTable,
    ImportMapping,
    import_file,
    mapping_of,
    read_table,
    with_decimal_sign,
)

SYNONYMS: Mapping[str, Sequence[str]] = {
    "SP": ("sp", "sv", "setpoint", "set_point", "set point"),
    "PV": ("pv", "process_value", "process value", "flow", "level", "temperature", "pressure"),
    "OP": ("op", "mv", "co", "controller_output", "controller output", "output", "drive"),
    "TIME": ("time", "timestamp", "datetime", "date", "t"),
}
"""What the columns are called where `columns` does not say it."""

TAGS: Mapping[str, LoopKind] = {"F": "flow", "P": "pressure", "L": "level", "T": "temperature"}
"""First letters of tags (ANSI/ISA-5.1)."""


def read_loop(
    source: Recording | str | Path, kind: str | None = None, columns: Mapping[str, str] | None = None
) -> tuple[ControlLoop, tuple[str, ...]]:
    """The loop of a recording or of a file, and sentences on what had to be guessed.

    columns : by SP, PV, OP and TIME, the name of the column or its number from 1, perhaps with ``:UNIT``;
    TIME may be two columns, ``Date+Time``.

    Raises BadInput where a column is not there, or the loop cannot be judged; BadParameter for a kind there is not.
    """
    if kind is not None and kind not in LOOP_KINDS:
        raise BadParameter("loop", kind, "there is no such kind of loop", f"use {', '.join(LOOP_KINDS)}")
    named = {name.upper(): text for name, text in (columns or {}).items()}
    unknown = next((name for name in named if name not in SYNONYMS), None)
    if unknown:
        raise BadParameter("columns", unknown, "it is not a column of a loop", f"there are {', '.join(SYNONYMS)}")
    if isinstance(source, Recording):
        return _from_recording(source, _kind(kind), named)
    return _from_file(Path(source), _kind(kind), named)


def _kind(kind: str | None) -> LoopKind | None:
    return next((one for one in LOOP_KINDS if one == kind), None)


def _from_recording(
    recording: Recording, kind: LoopKind | None, named: Mapping[str, str]
) -> tuple[ControlLoop, tuple[str, ...]]:
    found: dict[str, Array | None] = {}
    unit = ""
    for role in ("SP", "PV", "OP"):
        name = named.get(role, "").partition(":")[0] or _first(recording, SYNONYMS[role])
        if name is None and role != "SP":
            raise BadInput(
                recording.label, f"nothing says which signal is {role}", _there(recording), parameter="columns"
            )
        found[role] = None if name is None else recording[name].values
        if role == "OP" and name is not None:
            unit = named.get("OP", "").partition(":")[2] or recording[name].unit
    recording.check()
    pv, op = found["PV"], found["OP"]
    assert pv is not None
    assert op is not None
    kind, said = (kind, ()) if kind else _guessed_kind(recording.plant.tag or "")
    op, percent, more = _op_in_percent(op, unit)
    return loop_of(recording.label, recording.time, found["SP"], pv, op, percent, kind), (*said, *more)


def _there(recording: Recording) -> str:
    return f"signals there: {', '.join(recording)}"


def _first(there: Recording, names: Sequence[str]) -> str | None:
    by_fold = {name.casefold(): name for name in there}
    return next((by_fold[name] for name in names if name in by_fold), None)


def _from_file(path: Path, kind: LoopKind | None, named: Mapping[str, str]) -> tuple[ControlLoop, tuple[str, ...]]:
    table, options, _ = with_decimal_sign(path, ImportMapping(), read_table(path))
    chosen = {role: _column(table, role, named.get(role)) for role in ("SP", "PV", "OP")}
    chosen["TIME"], of_day = _time_columns(table, named.get("TIME"))
    for role in ("PV", "OP", "TIME"):
        if chosen[role] is None:
            there = ", ".join(table.names[:20])
            raise BadInput(
                str(path), f"nothing says which column is {role}", f"columns there: {there}", parameter="columns"
            )
    signals = {role.lower(): {"column": name, "unit": "1"} for role, name in chosen.items() if name and role != "TIME"}
    clock, said = _clock(table, str(chosen["TIME"]), of_day, named.get("TIME", "").partition(":")[2])
    texts = _texts(table, [one["column"] for one in signals.values()])
    read_as = {"missing": texts, "decimal": options.file.decimal}
    about = {"signals": signals, "time": clock, "carry": False, "file": read_as}
    recording, newest_first = _imported(path, table, about)
    recording.check()
    unit = named.get("OP", "").partition(":")[2] or table.units.get(str(chosen["OP"]), "")
    op, percent, more = _op_in_percent(recording["op"].values, unit)
    guess: tuple[str, ...] = ()
    if kind is None:
        kind, guess = _guessed_kind(" ".join((path.name, *(str(name) for name in chosen.values()))))
    sp = recording["sp"].values if "sp" in recording else None
    loop = loop_of(str(path), recording.time, sp, recording["pv"].values, op, percent, kind)
    without = (f"samples without a number are missing: {', '.join(texts)}",) if texts else ()
    turned = ("the newest row stands first: rows are read from the end",) if newest_first else ()
    return loop, (*said, *guess, *more, *without, *turned)


def _imported(path: Path, table: ForeignTable, about: dict[str, Any]) -> tuple[Recording, bool]:
    """The recording of a file, and whether its newest row stood first."""
    try:
        return import_file(path, mapping_of(about, "columns")).recording, False
    except BadInput as wrong:
        if "time_repair" not in wrong.parameters:
            raise
        about = about | {"time": about["time"] | {"repair": "sort"}}
        found = import_file(path, mapping_of(about, "columns")).recording
        if np.array_equal(found["pv"].values, table.columns[about["signals"]["pv"]["column"]][::-1], equal_nan=True):
            return found, True
        words = f"the clock runs backwards or stands still ({wrong.found})"
        raise BadInput(wrong.where, words, "sort the rows by time and leave out those that are there twice") from None


def _texts(table: ForeignTable, names: Sequence[str]) -> list[str]:
    """What a historian has in place of numbers: "Bad", "No Data"."""
    cells = [table.bad_cells[name] for name in names if name in table.bad_cells]
    return list(dict.fromkeys(text for one in cells for text in (one.text, *one.others)))


def _column(table: ForeignTable, role: str, given: str | None) -> str | None:
    if given:
        return table.name_of(given.partition(":")[0])
    for name in SYNONYMS[role]:
        found = table.find(name)
        if found is not None:
            return found
    ends = [name for name in table.names if name.casefold().endswith((f".{role.casefold()}", f"_{role.casefold()}"))]
    return ends[0] if len(ends) == 1 else None


def _time_columns(table: ForeignTable, given: str | None) -> tuple[str | None, str | None]:
    """The column of the time, and that of the time of day where the first has only dates: ``Date+Time``."""
    day, plus, of_day = (given or "").partition(":")[0].partition("+")
    if plus and table.find(f"{day}+{of_day}") is None:
        return table.name_of(day), table.name_of(of_day)
    column, date = _column(table, "TIME", given), table.find("date")
    if given is None and date is not None and date != column and column in table.bad_cells:
        return date, column
    return column, None


def _clock(table: ForeignTable, column: str, of_day: str | None, unit: str) -> tuple[dict[str, str], tuple[str, ...]]:
    """What the importer is told of the time: dates where the cells are no numbers, else a unit or seconds."""
    if of_day is not None:
        return {"column": column, "of_day": of_day, "unit": "iso8601"}, ()
    if column in table.bad_cells:
        return {"column": column, "unit": "iso8601"}, ()
    unit = unit or table.units.get(column, "")
    said = () if unit else ("the time has no unit: seconds are taken",)
    return {"column": column, "unit": unit or "s"}, said


def _op_in_percent(op: Array, unit: str) -> tuple[Array, bool, tuple[str, ...]]:
    """OP in % of its range and whether that is known; a sentence where it is given in another unit, or in none."""
    if unit in ("%", "percent"):
        return op, True, ()
    if unit == "mA":
        return (op - 4.0) / 0.16, True, ("OP is in mA: 4 to 20 mA are taken as 0 to 100 %",)
    if unit not in ("", "1"):
        return op, False, (f"OP is in {unit}, not in %: S and J are not given",)
    known = op[np.isfinite(op)]
    if unit == "1" and len(known) and np.max(np.abs(known)) <= 1.5:
        return op * 100.0, True, ()
    if len(known) and known.min() >= -10.0 and known.max() <= 110.0 and known.max() > 1.5:
        return op, True, ("OP has no unit: it is taken as %",)
    words = "the unit of OP is missing and cannot be guessed: S and J are not given"
    return op, False, (words,)


def _guessed_kind(text: str) -> tuple[LoopKind | None, tuple[str, ...]]:
    """The kind of loop that a tag such as FIC-211 says."""
    found = re.search(r"(?<![A-Za-z])([FPLT])I?C(?![A-Za-z])", text)
    if found is None:
        return None, ()
    kind = TAGS[found.group(1)]
    return kind, (f"the tag {found.group(0)} says that it is a {kind} loop",)
