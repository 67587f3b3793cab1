"""The clock of an imported recording, and which rows of the table it keeps."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from recordings.arrays import Array, IndexArray
from recordings.column_headers import known_name
from recordings.errors import BadInput
from recordings.importers.dates import DAY_FIRST, ISO, MONTH_FIRST, date_of
from recordings.importers.mapping import FileLayout, TimeAxis
from recordings.importers.table import ForeignTable
from recordings.sample_checks import time_fault
from recordings.units import convert

_REPAIR = "the time of the rows must increase; choose the repair 'drop', which leaves out those that do not, or 'sort'"
_GIVE_TIME = "say which column is time and its unit, or give the rate of evenly spaced rows"


def time_column(table: ForeignTable, clock: TimeAxis) -> str | None:
    """The column that holds time: the one named, else one called time or t with a unit; None for a rate."""
    if clock.column is not None:
        return table.name_of(clock.column)
    if clock.rate_hz is not None:
        return None
    meant = [name for name in table.columns if known_name(name) == "time"]
    found = table.find("time") or table.find("t") or (meant[0] if len(meant) == 1 else None)
    if found is None:
        remedy = f"{_GIVE_TIME}; columns: {', '.join(table.names)}"
        raise BadInput(table.where, "nothing says what the time is", remedy, parameter=("time", "rate_hz"))
    return found


def keep_rows(table: ForeignTable, clock: TimeAxis, layout: FileLayout, n_rows: int) -> tuple[IndexArray, Array]:
    """The rows to keep, in the order of time, and their time [s]; shape (n_kept,) each.

    Rows are dropped from the start, turned round, repaired and cut as the layout and the clock say.

    Raises
    ------
    BadInput
        Nothing says what the time is, or it does not increase and is not to be repaired, naming the row.
    """
    rows = _turned(table, layout, np.arange(n_rows)[layout.drop_rows :])
    column = time_column(table, clock)
    if column is None:
        time = np.arange(len(rows)) / float(clock.rate_hz or 1.0)
    else:
        time = _seconds(table, column, clock)[rows]
        if clock.repair != "refuse":
            rows, time = _repaired(rows, time, clock.repair)
    if len(rows) < 2:
        remedy = "a recording needs at least 2: drop fewer rows, or choose another repair of the time"
        found = f"{len(rows)} rows of data are left"
        raise BadInput(table.where, found, remedy, parameter=("drop_rows", "time_repair"))
    fault = time_fault(time)
    if fault is not None:
        where, found = table.row(int(rows[fault[0]])), _fault_in_words(time, fault[0])
        raise BadInput(where, found, _REPAIR, parameter="time_repair")
    inside = (time >= _or(clock.from_s, -np.inf)) & (time <= _or(clock.until_s, np.inf))
    if inside.sum() < 2:
        found = f"{inside.sum()} rows lie between the limits of time"
        raise BadInput(table.where, found, f"time runs from {time[0]:g} to {time[-1]:g} s")
    return rows[inside], time[inside]


def first_date(table: ForeignTable, clock: TimeAxis) -> datetime | None:
    """The date of the first row, when time is written as dates; one without a time zone is taken for UTC."""
    if clock.date_format is None or clock.column is None:
        return None
    texts = table.texts.get(table.name_of(clock.column), ())
    date = _dates(table, table.name_of(clock.column), clock)[0] if texts else None
    return date if date is None or date.tzinfo else date.replace(tzinfo=UTC)


def _fault_in_words(time: Array, sample: int) -> str:
    if not np.isfinite(time[sample]):
        return "the time is missing"
    how = "repeats" if time[sample] == time[sample - 1] else "goes backwards"
    return f"time {how}: {time[sample]:.9g} s after {time[sample - 1]:.9g} s"


def _or(value: float | None, other: float) -> float:
    return other if value is None else value


def _turned(table: ForeignTable, layout: FileLayout, rows: IndexArray) -> IndexArray:
    """The rows with those turned round that were listed against their order in time."""
    if layout.reverse is None:
        return rows
    texts = table.texts.get(table.name_of(layout.reverse.column), ())
    turn = np.array([text.strip() == layout.reverse.value for text in texts], dtype=bool)[rows]
    turned = rows.copy()
    turned[turn] = rows[turn][::-1]
    return turned


def _repaired(rows: IndexArray, time: Array, how: str) -> tuple[IndexArray, Array]:
    """Rows without missing times, sorted when asked for, without those at which time does not increase."""
    there = np.isfinite(time)
    rows, time = rows[there], time[there]
    if how == "sort":
        order = np.argsort(time, kind="stable")
        rows, time = rows[order], time[order]
    latest = np.concatenate(([-np.inf], np.maximum.accumulate(time)[:-1])) if len(time) else time
    return rows[time > latest], time[time > latest]


def _seconds(table: ForeignTable, column: str, clock: TimeAxis) -> Array:
    if clock.date_format is not None and column not in table.texts and table.units.get(column) == "s":
        return table.numbers(column)  # a file whose dates are dates: they were read as seconds
    if clock.date_format is not None:
        return _seconds_of_dates(table, column, clock)
    symbol = clock.unit or table.units.get(column)
    where = f"{table.where}: column '{column}'"
    if symbol is None:
        raise BadInput(where, "the unit of the time is not known", "give it, such as s, ms or min", parameter="time")
    return convert(table.numbers(column), symbol, "s", where)


_REMEDIES = {
    ISO: "dates are ISO 8601, such as 2026-11-21 09:30:00.125 or 2026-11-21T09:30:00+01:00",
    DAY_FIRST: "dates have the day first, such as 21.11.2026 09:30:00,125",
    MONTH_FIRST: "dates have the month first, such as 11/21/2026 9:30:00.125 PM",
}


def _dates(table: ForeignTable, column: str, clock: TimeAxis) -> list[datetime | None]:
    """The dates of a column, with the time of day of another where there is one."""
    form, dates, texts = clock.date_format or ISO, list[datetime | None](), list(table.texts.get(column, ()))
    if clock.of_day is not None:
        times = table.texts.get(table.name_of(clock.of_day), ())
        texts = [f"{day.strip()} {time.strip()}" for day, time in zip(texts, times, strict=True)]
    for row, text in enumerate(map(str.strip, texts)):
        dates.append(date_of(text, form) if text else None)
        if text and dates[-1] is None:
            remedy = _REMEDIES.get(form, f"dates are written as {form}")
            raise BadInput(table.row(row), f"'{text[:40]}' is not a date", remedy, parameter="time_format")
    return dates


def _seconds_of_dates(table: ForeignTable, column: str, clock: TimeAxis) -> Array:
    """Seconds since the first date that is there; dates without a time zone are taken as they stand."""
    dates = [date.replace(tzinfo=date.tzinfo or UTC) if date else None for date in _dates(table, column, clock)]
    first = next((date for date in dates if date), None)
    if first is None:
        raise BadInput(f"{table.where}: column '{column}'", "it holds no date", "time as text works for CSV and TSV")
    return np.array([(date - first).total_seconds() if date else np.nan for date in dates])
