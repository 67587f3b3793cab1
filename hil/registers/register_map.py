"""What is where in a device: the register map for reading, the separate one for writing, and how reads are grouped.

A map is a TOML file (or a CSV table of its points). It is a value: nothing in it changes after loading.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from hil.registers.map_file import read_csv, read_map, validated
from hil.registers.point import BIT_TABLES, READ_FUNCTION, Point, RegisterTable
from hil.registers.ring import Ring
from recordings import BadInput

MOST_BITS = 2000
"""The protocol's limit of bits in one read."""
MOST_POINTS = 4096
"""More than any device has; a map with more was not made for one."""


@dataclass(frozen=True)
class ReadBlock:
    """One read request and the points that its reply answers: `count` registers (or bits) from `address` on."""

    unit_id: int
    table: RegisterTable
    address: int
    count: int
    points: tuple[Point, ...]

    @property
    def function_code(self) -> int:
        """The Modbus function code of the request: 1, 2, 3 or 4."""
        return READ_FUNCTION[self.table]

    @property
    def form(self) -> tuple[int, int, int]:
        """What a serial line tells replies apart by: unit, function code and bytes of data."""
        return self.unit_id, self.function_code, (self.count + 7) // 8 if self.table in BIT_TABLES else 2 * self.count

    def registers_of(self, point: Point, reply: Sequence[int]) -> Sequence[int]:
        """The part of a reply, `count` registers, that belongs to a point; shorter when the reply is too short."""
        start = point.address - self.address
        return reply[start : start + point.count]


class RegisterMap(BaseModel):
    """Where to read what. Build one with `load`.

    max_hole : registers that nobody asked for and that a read may run across to save a second read;
    max_read : most registers in one read (some devices allow fewer than the protocol's 125);
    heartbeat : name of a point that must change between polls while the device is alive;
    ring : the device's memory of its last samples, if it has one.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["read"] = "read"
    name: Annotated[str, Field(min_length=1)]
    points: Annotated[tuple[Point, ...], Field(min_length=1, max_length=MOST_POINTS)]
    max_hole: Annotated[int, Field(ge=0, le=124, strict=True)] = 8
    max_read: Annotated[int, Field(ge=1, le=125, strict=True)] = 125
    heartbeat: str | None = None
    ring: Ring | None = None

    @classmethod
    def load(cls, source: str | Path) -> Self:
        """A map from a TOML or CSV file, or one of those that come with the program by name (``"damadics"``).

        Raises BadInput naming the file, the place in it, and what to do.

        >>> RegisterMap.load("damadics").point("position").unit
        'm'
        """
        return read_map(cls, source)

    @classmethod
    def from_csv(cls, path: str | Path) -> Self:
        """A map from a CSV table with one point per row and the keys of a point as column names.

        A valid range is two columns, ``valid_min`` and ``valid_max``; several invalid values are separated by blanks;
        an empty cell means the default. Raises BadInput naming the row.
        """
        return validated(cls, read_csv(Path(path)), str(path))

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        _refuse_clashes(self.points)
        names = [point.name for point in self.points]
        if self.heartbeat is not None and self.heartbeat not in names:
            raise ValueError(f"heartbeat: there is no point named {self.heartbeat!r}; name one of the points")
        wide = next((p for p in self.points if p.table not in BIT_TABLES and p.count > self.max_read), None)
        if wide is not None:
            raise ValueError(f"max_read: {self.max_read} is less than the {wide.count} registers of {wide.name!r}")
        if self.ring is not None:
            self.ring.refuse_clashes(self.points)
        return self

    def point(self, name: str) -> Point:
        """The point of that name. Raises BadInput listing the names there are."""
        return _named(self.name, self.points, name)

    def reads(self) -> tuple[ReadBlock, ...]:
        """The requests that read every point once, in order of unit, table and address.

        >>> [(block.address, block.count) for block in RegisterMap.load("positioner-int16").reads()]
        [(100, 3), (0, 8)]
        """
        return grouped(self.points, self.max_hole, self.max_read)

    def look_alikes(self) -> tuple[ReadBlock, ...]:
        """The reads whose replies have the form of another one's: on a serial line, where replies have no number, one
        in the place of the other cannot be told.
        """
        reads = self.reads()
        forms = Counter(block.form for block in reads)
        return tuple(block for block in reads if forms[block.form] > 1)

    def on_unit(self, unit_id: int) -> RegisterMap:
        """The same map for another device id, for several equal devices on one line."""
        moved = tuple(point.model_copy(update={"unit_id": unit_id}) for point in self.points)
        return self.model_copy(update={"points": moved})


class WriteMap(BaseModel):
    """Which points may be written at all: a file of its own, `kind = "write"`, so that no reading map can write."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["write"]
    name: Annotated[str, Field(min_length=1)]
    points: Annotated[tuple[Point, ...], Field(min_length=1, max_length=MOST_POINTS)]

    @classmethod
    def load(cls, source: str | Path) -> Self:
        """A write map from a TOML file, or a shipped one by name (``"damadics-write"``). Raises BadInput as above."""
        return read_map(cls, source)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        _refuse_clashes(self.points)
        for k, point in enumerate(self.points):
            if point.table not in {"holding", "coil"}:
                raise ValueError(f"points[{k}].table: the {point.table} table cannot be written; use holding or coil")
            if point.bit is not None:
                raise ValueError(f"points[{k}].bit: one bit cannot be written without the other 15; write the register")
        return self

    def point(self, name: str) -> Point:
        """The point of that name. Raises BadInput listing the names there are."""
        return _named(self.name, self.points, name)

    def on_unit(self, unit_id: int) -> WriteMap:
        """The same map for another device id."""
        moved = tuple(point.model_copy(update={"unit_id": unit_id}) for point in self.points)
        return self.model_copy(update={"points": moved})


def grouped(points: Iterable[Point], max_hole: int, max_read: int) -> tuple[ReadBlock, ...]:
    """Points joined into as few reads as the hole and length limits allow, going up the addresses once."""
    blocks: list[ReadBlock] = []
    for point in sorted(points, key=lambda p: (p.unit_id, READ_FUNCTION[p.table], p.address)):
        last = blocks[-1] if blocks else None
        longest = MOST_BITS if point.table in BIT_TABLES else max_read
        if last is not None and _joins(last, point, max_hole, longest):
            count = max(last.count, point.end - last.address)
            blocks[-1] = ReadBlock(last.unit_id, last.table, last.address, count, (*last.points, point))
        else:
            blocks.append(ReadBlock(point.unit_id, point.table, point.address, point.count, (point,)))
    return tuple(blocks)


def _joins(block: ReadBlock, point: Point, max_hole: int, longest: int) -> bool:
    same = (block.unit_id, block.table) == (point.unit_id, point.table)
    hole = point.address - (block.address + block.count)
    return same and hole <= max_hole and point.end - block.address <= longest


def _refuse_clashes(points: Sequence[Point]) -> None:
    """Two points with one name, or on the same bits without saying `overlap = true`, are a mistake in the map."""
    first: dict[str, int] = {}
    owner: dict[tuple[int, str, int, int], int] = {}
    for k, point in enumerate(points):
        if point.name in first:
            raise ValueError(f"points[{k}].name: {point.name!r} is already the name of points[{first[point.name]}]")
        first[point.name] = k
        if not point.overlap:
            _claim(points, k, owner)


def _claim(points: Sequence[Point], k: int, owner: dict[tuple[int, str, int, int], int]) -> None:
    point = points[k]
    bits = range(16) if point.bit is None else (point.bit,)
    for address in range(point.address, point.end):
        for bit in bits:
            taken = owner.setdefault((point.unit_id, point.table, address, bit), k)
            if taken != k:
                raise ValueError(
                    f"points[{k}].address: {point.name!r} overlaps {points[taken].name!r} at {point.table} address "
                    f"{address} of unit {point.unit_id}; correct one of them, or say overlap = true if it is meant"
                )


def _named(map_name: str, points: Sequence[Point], name: str) -> Point:
    for point in points:
        if point.name == name:
            return point
    names = ", ".join(point.name for point in points)
    raise BadInput(f"register map {map_name!r}", f"there is no point {name!r}", f"it has: {names}")
