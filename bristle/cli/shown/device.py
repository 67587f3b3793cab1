"""A probe on the terminal and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from bristle.cli.output.tables import words_table
from hil import ProbedPoint, ProbedValve

if TYPE_CHECKING:
    from rich.table import Table


def probe_table(found: ProbedValve) -> Table:
    """Every point: where it is, its registers, its value and quality, and the values under other byte orders."""
    heads = ("point", "where", "raw", "value", "quality", "other orders")
    rows = [
        (one.point.name, _where(one), one.raw or "-", _value(one), _quality(one), "  ".join(_others(one)))
        for one in found.points
    ]
    return words_table(heads, rows, title=f"{found.valve}: {found.good} of {len(found.points)} values good")


def probe_facts(source: str, register_map: str, found: tuple[ProbedValve, ...]) -> dict[str, Any]:
    """The same as JSON."""
    valves = [
        {
            "valve": valve.valve, "good": valve.good, "likely_byte_order": valve.likely_order,
            "advice": list(valve.advice), "points": [_facts(one) for one in valve.points],
        }
        for valve in found
    ]  # fmt: skip
    return {"format": "register-probe", "version": 1, "source": source, "map": register_map, "valves": valves}


def _facts(one: ProbedPoint) -> dict[str, Any]:
    point, reading = one.point, one.reading
    return {
        "name": point.name, "device": point.unit_id, "table": point.table, "address": point.address,
        "type": point.type, "byte_order": point.byte_order, "raw": [f"0x{word:04X}" for word in one.words],
        "value": reading.value if reading.good else None, "unit": point.unit, "quality": str(reading.quality),
        "reason": reading.reason, "other_orders": dict(one.others),
    }  # fmt: skip


def _where(one: ProbedPoint) -> str:
    point = one.point
    last = f"-{point.end - 1}" if point.count > 1 else "" if point.bit is None else f".{point.bit}"
    return f"{point.unit_id} {point.table} {point.address}{last}"


def _value(one: ProbedPoint) -> str:
    return f"{one.reading.value:.6g} {one.point.unit}" if one.reading.good else "-"


def _quality(one: ProbedPoint) -> str:
    return str(one.reading.quality) + (f": {one.reading.reason}" if one.reading.reason else "")


def _others(one: ProbedPoint) -> Iterator[str]:
    for order, value in one.others.items():
        yield f"{order} {'-' if value is None else f'{value:.4g}'}"
