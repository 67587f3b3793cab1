"""A register map in words: a table of its points, the requests that read them, and its ring."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator
from html import escape
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hil.registers.map_file import locate, read_toml
from hil.registers.point import Point
from hil.registers.register_map import RegisterMap, WriteMap

_COLUMNS = ("device", "table", "address", "type", "order", "name", "value", "unit", "range", "invalid", "meaning")

TABLE_WIDTH = 140
"""Characters that the table needs; with fewer the points are listed."""


def describe_register_map(source: str | Path, width: int = 160) -> str:
    """What a reading or writing map says, as text `width` characters wide; loading it checks overlaps and all else.

    Raises BadInput as `RegisterMap.load` does.

    >>> print(describe_register_map("damadics-write").splitlines()[0])
    damadics-write: a map for writing, 23 points without overlap
    """
    path = locate(source)
    writes = path.suffix != ".csv" and read_toml(path).get("kind") == "write"
    shown: RegisterMap | WriteMap = WriteMap.load(path) if writes else RegisterMap.load(path)
    out = Console(file=io.StringIO(), width=width, color_system=None, highlight=False)
    out.print(Text(_summary(shown)), soft_wrap=True)
    if width < TABLE_WIDTH:
        for line in _listed(shown.points, width):
            out.print(Text(line), soft_wrap=True)
    else:
        out.print(_table(shown.points))
    if isinstance(shown, RegisterMap):
        for line in (*_requests(shown), *_ring(shown)):
            out.print(Text(line), soft_wrap=True)
    text = out.file.getvalue()  # type: ignore[attr-defined]
    return "\n".join(line.rstrip() for line in text.splitlines())


def register_map_page(source: str | Path) -> str:
    """The same as a self-contained HTML page. Raises BadInput as `RegisterMap.load` does."""
    title, text = escape(Path(source).name), escape(describe_register_map(source, width=200))
    return f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>{title}</title>\n<pre>{text}</pre></html>\n'


def _summary(shown: RegisterMap | WriteMap) -> str:
    meant = sum(point.overlap for point in shown.points)
    points = (
        f"{_many(len(shown.points), 'point')}{f', {meant} overlapping on purpose' if meant else ' without overlap'}"
    )
    if isinstance(shown, WriteMap):
        return f"{shown.name}: a map for writing, {points}"
    read = f"read with {_many(len(shown.reads()), 'request')}"
    return f"{shown.name}: a map for reading, {points}, {read}, heartbeat {shown.heartbeat or 'none'}"


def _many(n: int, thing: str) -> str:
    return f"{n} {thing}{'' if n == 1 else 's'}"


def _table(points: tuple[Point, ...]) -> Table:
    table = Table(*_COLUMNS, box=SIMPLE_HEAD, pad_edge=False)
    for point in sorted(points, key=lambda p: (p.unit_id, p.table, p.address, p.bit or 0)):
        table.add_row(*(Text(cell) for cell in _row(point)))
    return table


def _listed(points: tuple[Point, ...], width: int) -> Iterator[str]:
    """The points one after the other: where and how on one line, what it means on lines below."""
    for point in sorted(points, key=lambda p: (p.unit_id, p.table, p.address, p.bit or 0)):
        device, table, address, type_, order, name, value, unit, limits, invalid, meaning = _row(point)
        yield f"{name}: device {device}, {table} {address}, {' '.join(part for part in (type_, order) if part)}"
        about = [f"{value} [{unit}]", f"range {limits}" if limits else "", f"invalid {invalid}" if invalid else ""]
        text = "; ".join(part for part in (*about, meaning) if part)
        yield from textwrap.wrap(text, width, initial_indent="    ", subsequent_indent="    ")


def _row(point: Point) -> tuple[str, ...]:
    last = f"-{point.end - 1}" if point.count > 1 else "" if point.bit is None else f".{point.bit}"
    order = point.byte_order if point.type != "bit" else ""
    scaled = "raw" if point.scale == 1.0 else f"raw x {point.scale:g}"
    offset = f" {point.offset:+g}" if point.offset else ""
    limits = f"{point.valid_range[0]:g} to {point.valid_range[1]:g}" if point.valid_range else ""
    return (
        str(point.unit_id),
        point.table,
        f"{point.address}{last}",
        point.type,
        order,
        point.name,
        f"{scaled}{offset}",
        point.unit,
        limits,
        " ".join(f"{value:g}" for value in point.invalid),
        point.description,
    )


def _requests(shown: RegisterMap) -> list[str]:
    return [
        f"request {k}: unit {block.unit_id}, function {block.function_code}, {block.table} "
        f"{block.address} to {block.address + block.count - 1} ({block.count})"
        for k, block in enumerate(shown.reads(), 1)
    ]


def _ring(shown: RegisterMap) -> list[str]:
    if shown.ring is None:
        return []
    ring, size = shown.ring, shown.ring.slot_size(shown.points)
    return [
        f"ring: the last {ring.samples} samples of {', '.join(ring.points)}, {size} registers each, "
        f"{ring.table} {ring.address} to {ring.address + size * ring.samples - 1}"
    ]
