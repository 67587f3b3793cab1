"""The short forms in which options say what a mapping of an import, or a plant, says at length."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from recordings import did_you_mean
from recordings.errors import BadInput

if TYPE_CHECKING:
    from recordings import Plant


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
    """The items of a `Plant` from options ``NAME=VALUE``; `BadInput` on anything else.

    >>> plant_of(["stroke_m=0.0381", "tag=LC74_20"])
    {'stroke_m': 0.0381, 'tag': 'LC74_20'}
    """
    return dict(_plant_item(option) for option in options)


def plant_from(options: Iterable[str]) -> Plant:
    """The plant that options ``NAME=VALUE`` describe; `BadInput` for one that cannot be."""
    from recordings import Plant

    items: dict[str, Any] = plant_of(options)
    return Plant(**items)


def _plant_item(option: str) -> tuple[str, float | str]:
    from recordings import Plant

    text, equals, value = option.partition("=")
    name, known = text.strip(), Plant.__dataclass_fields__
    if not equals:
        raise BadInput("--plant", f"'{option}' names no value", "write --plant NAME=VALUE, such as stroke_m=0.0381")
    if name not in known:
        close = did_you_mean(name, known)
        remedy = f"{close}{' ' if close else ''}write one of {', '.join(known)}"
        raise BadInput("--plant", f"'{name}' is not known of a plant", remedy)
    try:
        return name, value if name == "tag" else float(value)
    except ValueError:
        raise BadInput("--plant", f"'{value}' is not a number", f"write --plant {name}=NUMBER") from None


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
    from recordings import ROLES

    parts = text.split(":")
    role = parts.pop() if len(parts) > 1 and parts[-1] in ROLES else ""
    symbol = parts.pop() if len(parts) > 1 else ""
    return ":".join(parts).strip(), symbol.strip(), role
