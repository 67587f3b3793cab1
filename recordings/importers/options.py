"""The short forms in which a command line says what a mapping says at length."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from recordings.errors import BadInput
from recordings.signal import ROLES


def signals_of(options: Iterable[str]) -> dict[str, dict[str, Any]]:
    """The section `signals` of a mapping from options ``NAME=COLUMN[:UNIT[:ROLE]]``; `BadInput` on anything else.

    >>> signals_of(["position=5:mm", "force=gtau*vir:N:input"])["force"]
    {'column': 'gtau*vir', 'unit': 'N', 'role': 'input'}
    """
    return dict(_signal_of(option) for option in options)


def clock_of(option: str | None) -> dict[str, Any]:
    """The column and unit of time from an option ``COLUMN[:UNIT]``; empty when it is not given."""
    if option is None:
        return {}
    column, symbol, _ = _parts(option)
    return {"column": column} | ({"unit": symbol} if symbol else {})


def plant_of(options: Iterable[str]) -> dict[str, float | str]:
    """The section `plant` of a mapping from options ``NAME=VALUE``; `BadInput` on anything else."""
    plant: dict[str, float | str] = {}
    for option in options:
        name, given, value = option.partition("=")
        if not given:
            raise BadInput("--plant", f"'{option}' names no value", "write --plant NAME=VALUE, such as stroke_m=0.0381")
        try:
            plant[name.strip()] = value if name.strip() == "tag" else float(value)
        except ValueError:
            raise BadInput("--plant", f"'{value}' is not a number", f"write --plant {name}=NUMBER") from None
    return plant


def _signal_of(option: str) -> tuple[str, dict[str, Any]]:
    name, given, source = option.partition("=")
    column, symbol, role = _parts(source)
    remedy = "write --column NAME=COLUMN:UNIT, such as --column position=5:mm"
    if not given or not name.strip() or not column:
        raise BadInput("--column", f"'{option}' names no column", remedy)
    if name.strip() == "time":
        raise BadInput("--column", "time has an option of its own", f"write --time {source}")
    given_parts = {"column": column, "unit": symbol, "role": role}
    return name.strip(), {key: value for key, value in given_parts.items() if value}


def _parts(text: str) -> tuple[str, str, str]:
    """Column, unit and role; taken from the right, so that a column's name may hold a colon when a unit follows."""
    parts = text.split(":")
    role = parts.pop() if len(parts) > 1 and parts[-1] in ROLES else ""
    symbol = parts.pop() if len(parts) > 1 else ""
    return ":".join(parts).strip(), symbol.strip(), role
