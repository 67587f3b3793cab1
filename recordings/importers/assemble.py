"""From a table and what is said about it to a recording: units converted, roles given, rows put in order."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from typing import Any

import numpy as np

from recordings.arrays import Array
from recordings.column_headers import known_name, meant
from recordings.errors import BadInput
from recordings.importers.clock import keep_rows, time_column
from recordings.importers.formula import evaluate, names_in
from recordings.importers.mapping import ImportMapping, SignalSource
from recordings.importers.plausible import implausible
from recordings.importers.table import ForeignTable
from recordings.plant import Plant
from recordings.recording import Recording
from recordings.sample_checks import holds_number, size_problem
from recordings.signal import UNDERSTOOD, Role, Signal
from recordings.stored_units import stored_signal
from recordings.units import find_unit

_OPERATOR = re.compile(r"[-+*\[]")
_GIVE_UNIT = "give it, such as mm, N, bar or %"


@dataclass(frozen=True)
class Imported:
    """A recording made from a foreign file, and sentences about what was left out or repaired."""

    recording: Recording
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Raw:
    """Values as the table has them, shape (n_rows,), all rows, and their unit."""

    values: Array
    unit: str


def assemble(table: ForeignTable, mapping: ImportMapping, **about: Any) -> Imported:
    """Make a recording of a table.

    Parameters
    ----------
    table : ForeignTable
        The columns of the file.
    mapping : ImportMapping
        What they are.
    about
        Further fields of the recording.

    Raises
    ------
    BadInput
        A column is missing or holds something else than numbers, a unit is missing or unfit, or the time is not usable.
    """
    plant = _plant(mapping, table.where)
    constants = {**table.constants, **{name: x for name, x in plant.known().items() if not isinstance(x, str)}}
    sources = {name: one for name, one in mapping.signals.items() if not one.optional or _is_there(table, one)}
    carried, notes = _carried(table, mapping, sources) if mapping.carry else ({}, [])
    sources |= carried
    if not sources:
        remedy = f"say which column is the position, its unit, and so on; columns: {', '.join(table.names)}"
        raise BadInput(table.where, "no column is known to be a signal", remedy, parameter="column")
    clock = time_column(table, mapping.time)
    columns = [table.find(source.column) for source in sources.values() if source.column is not None]
    used = [clock] if clock is not None and clock not in table.texts else []
    table.refuse([*used, *(column for column in columns if column is not None)])
    raw = {name: _raw(table, name, source, constants) for name, source in sources.items()}
    n_rows = _common_length(table, mapping, raw)
    rows, time = keep_rows(table, mapping.time, mapping.file, n_rows)
    left_out = n_rows - mapping.file.drop_rows - len(rows)
    notes += [f"{left_out} of {n_rows} rows were left out: time repaired or cut"] if left_out else []
    signals = [Signal("time", time, "s", "time")]
    for name, source in sources.items():
        role = source.role or _usual_role(name, set(sources))
        values = raw[name].values[rows]
        wild = size_problem(np.where(np.isinf(values), np.nan, values))  # what is infinite is missing
        if wild:
            raise BadInput(f"{table.where}: '{name}'", wild[0], "correct it, or say that it means no value")
        signals.append(_signal(name, source, raw[name], raw[name].values[rows], role, plant, table.where))
    made = Recording.of(signals, plant=plant, **about)
    return Imported(
        made, (*table.notes, *notes, *_strangers(sources, carried), *_without_stroke(made), *implausible(made))
    )


def _without_stroke(made: Recording) -> Iterator[str]:
    """A sentence on a position in % of a stroke that nobody has said."""
    position = made.signals.get("position")
    known = find_unit(position.unit) if position is not None else None
    if known is not None and known.si == "1" and made.plant.stroke_m is None:
        yield "the position is a share of the stroke: say the stroke of the plant in metres, as stroke_m=0.0381"


def _strangers(sources: Mapping[str, SignalSource], carried: Mapping[str, SignalSource]) -> Iterator[str]:
    """Sentences on signals whose name looks like a slip of the pen, and on columns that were recognised."""
    for name in sources:
        question = meant(name, UNDERSTOOD) if name not in UNDERSTOOD and name not in carried else ""
        if question:
            yield f"'{name}' is no name that Bristle understands, and is carried along as an extra signal; {question}"
    for name, source in carried.items():
        if name in UNDERSTOOD and str(source.column).casefold() != name:
            yield f"column '{source.column}' was taken for the {name}"


def text_columns(mapping: ImportMapping) -> tuple[str | int, ...]:
    """The columns whose text is needed besides numbers: dates, and the marks of rows to turn round."""
    dates = mapping.time.column if mapping.time.date_format else None
    reverse = mapping.file.reverse.column if mapping.file.reverse else None
    return tuple(column for column in (dates, mapping.time.of_day, reverse) if column is not None)


def _plant(mapping: ImportMapping, where: str) -> Plant:
    try:
        return Plant(**mapping.plant)  # type: ignore[arg-type]  # Plant checks the type of each item
    except BadInput as wrong:
        raise BadInput(f"{where}: {wrong.where}", wrong.found, wrong.remedy) from None


def _is_there(table: ForeignTable, source: SignalSource) -> bool:
    return source.column is not None and table.find(source.column) is not None


def _formula(table: ForeignTable, source: SignalSource) -> str | None:
    """The formula of a source: given as one, or as the name of a column that is none."""
    if source.formula is not None or table.find(str(source.column)) is not None:
        return source.formula
    return str(source.column) if _OPERATOR.search(str(source.column)) else None


def _raw(table: ForeignTable, name: str, source: SignalSource, constants: Mapping[str, float]) -> _Raw:
    where = f"{table.where}: signal '{name}'"
    formula = _formula(table, source)
    if formula is not None:
        if source.unit is None:
            raise BadInput(where, f"the unit of '{formula}' is not known", _GIVE_UNIT, parameter="column")
        return _Raw(evaluate(formula, source.unit, table, constants, where), source.unit)
    column = table.name_of(source.column or "")
    symbol = source.unit or table.units.get(column)
    if symbol is None:
        raise BadInput(where, f"the unit of column '{column}' is not known", _GIVE_UNIT, parameter="column")
    return _Raw(table.numbers(column), symbol)


def _common_length(table: ForeignTable, mapping: ImportMapping, raw: Mapping[str, _Raw]) -> int:
    lengths = {name: len(one.values) for name, one in raw.items()}
    column = time_column(table, mapping.time)
    if column is not None:
        lengths = {"time": len(table.texts.get(column, table.columns[column]))} | lengths
    if len(set(lengths.values())) > 1:
        found = "the signals differ in length: " + ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise BadInput(table.where, found, "all signals of a recording have one length; leave out those that do not")
    return next(iter(lengths.values()))


def _signal(name: str, source: SignalSource, raw: _Raw, values: Array, role: Role, plant: Plant, where: str) -> Signal:
    where = f"{where}: signal '{name}'"
    if not holds_number(values):
        raise BadInput(where, "its column holds no number", "leave the signal out, or name another column")
    if source.period is not None:
        there = np.isfinite(values)
        values[there] = np.unwrap(values[there], period=source.period)
    return stored_signal(
        name, values, raw.unit, role, plant.stroke_m, where,
        description=source.description, resolution=source.resolution, noise_std=source.noise_std,
    )  # fmt: skip


def _usual_role(name: str, names: set[str]) -> Role:
    """The role of a signal nobody gave one: the position answers to what is nearest to a force."""
    if name == "position":
        return "output"
    driving = next((one for one in ("force", "pressure", "drive", "setpoint") if one in names), None)
    return "input" if name == driving else "extra"


def _carried(
    table: ForeignTable, mapping: ImportMapping, named: Mapping[str, SignalSource]
) -> tuple[dict[str, SignalSource], list[str]]:
    """The columns nobody named, as signals where their unit is known, and notes about those left out."""
    carried: dict[str, SignalSource] = {}
    without_unit, without_number = list[str](), list[str]()
    recognised = {c: n for c, n in recognised_columns(table, set(named)).items() if c in table.units}
    wrong = list[str]()
    for column in _unnamed(table, mapping, named):
        known = column.casefold() if column.casefold() in UNDERSTOOD else recognised.get(column)
        name = known or column.replace("/", "_")
        if name in named or name == "time":
            continue
        if column in table.bad_cells and name in UNDERSTOOD:
            wrong.append(column)  # what the recording is about is not left out for one cell
        if column in table.bad_cells or not holds_number(table.columns[column]):
            without_number.append(column)
        elif column not in table.units:
            without_unit.append(column)
        else:
            carried[name] = SignalSource(column=column)
    if wrong:
        table.refuse([*(str(table.find(str(source.column))) for source in named.values()), *wrong])
    notes = [f"columns without numbers were left out: {', '.join(without_number)}"] if without_number else []
    if without_unit:
        remedy = "to keep them, say which signal each is, and its unit"
        notes.append(f"columns without a unit were left out: {', '.join(without_unit)} ({remedy})")
    return carried, notes


def recognised_columns(table: ForeignTable, taken: Set[str]) -> dict[str, str]:
    """Columns whose header means an understood signal, with its name: where only one column means it, and it is not
    taken, also not by a column of that very name.
    """
    taken = taken | {name.casefold() for name in table.columns if name.casefold() in UNDERSTOOD}
    found = {column: known_name(column, table.units.get(column)) for column in table.columns}
    counts = Counter(found.values())
    return {
        column: name
        for column, name in found.items()
        if name is not None and name != "time" and counts[name] == 1 and name not in taken
    }


def _unnamed(table: ForeignTable, mapping: ImportMapping, named: Mapping[str, SignalSource]) -> Iterator[str]:
    used = {time_column(table, mapping.time)}
    for name, source in named.items():
        formula = _formula(table, source)
        references = names_in(formula, f"{table.where}: signal '{name}'") if formula else {str(source.column)}
        used |= {table.find(reference) for reference in references}
    return (column for column in table.columns if column not in used)
