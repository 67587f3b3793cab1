"""Dates as plants write them: ISO 8601, day or month first, decimal point or comma, 12 or 24 hours."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime, timedelta

ISO, DAY_FIRST, MONTH_FIRST = "iso8601", "day-first", "month-first"
NAMED = (ISO, DAY_FIRST, MONTH_FIRST)
"""The formats that have a name; any other is a pattern with the signs of strptime, such as ``%d.%m.%Y %H:%M:%S,%f``."""

_DATE = re.compile(
    r"(\d{1,4})[./-](\d{1,2})[./-](\d{1,4})[T ,]+(\d{1,2}):(\d{2})(?::(\d{2})(?:[.,](\d{1,9}))?)?\s*([AaPp][Mm])?"
)


def date_of(text: str, form: str) -> datetime | None:
    """The date that a text says in a format; None when it says none.

    >>> date_of("01.03.2026 08:00:00,250", "day-first")
    datetime.datetime(2026, 3, 1, 8, 0, 0, 250000)
    >>> date_of("3/1/2026 1:05:00 PM", "month-first")
    datetime.datetime(2026, 3, 1, 13, 5)
    """
    try:
        if form == ISO:
            return datetime.fromisoformat(text)
        return _written(text, form) if form in NAMED else datetime.strptime(text, form)
    except (ValueError, OverflowError):
        return None


def _written(text: str, form: str) -> datetime | None:
    match = _DATE.fullmatch(text)
    if match is None:
        return None
    first, second, third = (int(match[k]) for k in (1, 2, 3))
    if len(match[1]) == 4:
        year, month, day = first, second, third
    else:
        day, month = (first, second) if form == DAY_FIRST else (second, first)
        year = third + (2000 if len(match[3]) <= 2 else 0)
    hour = int(match[4])
    if match[8]:
        hour = hour % 12 + (12 if match[8].lower() == "pm" else 0)
    fraction = round(float(f"0.{match[7]}") * 1e6) if match[7] else 0
    return datetime(year, month, day, hour, int(match[5]), int(match[6] or 0)) + timedelta(microseconds=fraction)


def guess_format(texts: Sequence[str]) -> tuple[str, ...]:
    """The named formats that all of some texts can be in: none, one, or both orders of day and month.

    >>> guess_format(["01.03.2026 08:00:00,000"]), guess_format(["3/1/2026 8:00"]), guess_format(["3/13/2026 8:00"])
    (('day-first',), ('day-first', 'month-first'), ('month-first',))
    """
    there = [text.strip() for text in texts if text.strip()]
    if not there:
        return ()
    forms = [form for form in NAMED if all(date_of(text, form) is not None for text in there)]
    if ISO in forms:
        return (ISO,)
    if DAY_FIRST in forms and all(
        "." in text.split()[0] for text in there
    ):  # points: no country writes the month first
        return (DAY_FIRST,)
    return tuple(forms)
