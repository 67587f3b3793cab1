"""Which address of a served device means what, worked out once from its two maps and its plant."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hil.plant.plant import Command, ServedPlant
from hil.registers.point import BIT_TABLES, Point
from hil.registers.register_map import RegisterMap, WriteMap, grouped
from recordings import BadInput, convert

TABLES = ("coil", "discrete", "holding", "input")

SERVICE = {
    "sample_counter": "1",
    "status": "1",
    "running": "1",
    "lock_step": "1",
    "fault_active": "1",
    "late": "1",
    "lateness_p50": "s",
    "lateness_p99": "s",
    "lateness_max": "s",
    "step": "s",
}
"""Signals that the server itself has to offer, and their units."""

OWN_COMMANDS = {"advance": Command(), "run": Command(), "reset": Command()}
"""Commands that the server carries out itself."""


@dataclass(frozen=True)
class ServedPoint:
    """A point of a map and how its value [point unit] comes from, or goes to, the plant's unit."""

    point: Point
    from_plant: Callable[[float], float]
    to_plant: Callable[[float], float]
    harmful: bool = False


@dataclass(frozen=True)
class ServedRegisters:
    """The registers of one served device.

    readable, writable : places by table; legal : what may be read, as first address and the one behind the last, by
    table; ring_places : the places of one ring sample, in order.
    """

    read_map: RegisterMap
    readable: Mapping[str, tuple[ServedPoint, ...]]
    writable: Mapping[str, tuple[ServedPoint, ...]]
    legal: Mapping[str, tuple[tuple[int, int], ...]]
    ring_places: tuple[ServedPoint, ...]

    def is_legal(self, table: str, address: int, count: int) -> bool:
        """Whether a read of `count` from `address` stays within registers that exist (holes inside a block do)."""
        return any(start <= address and address + count <= end for start, end in self.legal[table])

    def in_ring(self, address: int) -> bool:
        """Whether an address of the ring's table belongs to the ring."""
        ring = self.read_map.ring
        if ring is None:
            return False
        return ring.address <= address < ring.address + ring.samples * ring.slot_size(self.read_map.points)

    def size(self, table: str) -> int:
        """One more than the last address of a table, at least 16."""
        return max((end for _, end in self.legal[table]), default=16)


def layout(plant: ServedPlant, read_map: RegisterMap, write_map: WriteMap | None) -> ServedRegisters:
    """Match maps with a plant. Raises BadInput for a point that the plant does not have, or in a foreign unit."""
    units = {**plant.units, **SERVICE}
    commands = {**plant.commands, **OWN_COMMANDS}
    readable = tuple(_place(read_map.name, p, units, "signal") for p in read_map.points)
    writable = tuple(_writable(write_map.name, p, commands) for p in write_map.points) if write_map else ()
    _refuse_disagreement(readable, writable)
    by_name = {place.point.name: place for place in readable}
    ring = read_map.ring.points if read_map.ring else ()
    for name in ring:
        if name not in plant.units and name != "sample_counter":
            found = f"{name!r} is not a signal of the plant"
            raise BadInput(f"register map {read_map.name!r}: ring", found, f"it has {', '.join(plant.units)}")
    return ServedRegisters(
        read_map,
        {t: tuple(p for p in readable if p.point.table == t) for t in TABLES},
        {t: tuple(p for p in writable if p.point.table == t) for t in TABLES},
        {t: _legal(t, read_map, [p.point for p in (*readable, *writable) if p.point.table == t]) for t in TABLES},
        tuple(by_name[name] for name in ring),
    )


def _writable(map_name: str, point: Point, commands: Mapping[str, Command]) -> ServedPoint:
    place = _place(map_name, point, {name: command.unit for name, command in commands.items()}, "command")
    return ServedPoint(point, place.from_plant, place.to_plant, commands[point.name].harmful)


def _place(map_name: str, point: Point, units: Mapping[str, str], what: str) -> ServedPoint:
    where = f"register map {map_name!r}: point {point.name!r}"
    if point.name not in units:
        raise BadInput(where, f"the plant has no {what} of that name", f"it has {', '.join(units)}")
    own = units[point.name]
    if own == point.unit:
        return ServedPoint(point, float, float)
    convert(1.0, own, point.unit, where)
    return ServedPoint(point, lambda v: convert(v, own, point.unit), lambda v: convert(v, point.unit, own))


def _refuse_disagreement(readable: tuple[ServedPoint, ...], writable: tuple[ServedPoint, ...]) -> None:
    """A register may be in both maps only as the same point: reading back what was written."""
    for one in (place.point for place in readable):
        for other in (place.point for place in writable):
            meets = one.table == other.table and one.address < other.end and other.address < one.end
            if meets and (one.address, one.type, one.byte_order) != (other.address, other.type, other.byte_order):
                raise BadInput(
                    f"write map: point {other.name!r}",
                    f"it overlaps {one.name!r} of the reading map at {one.table} address {other.address}",
                    "move one of them",
                )


def _legal(table: str, read_map: RegisterMap, points: list[Point]) -> tuple[tuple[int, int], ...]:
    blocks = [(block.address, block.address + block.count) for block in grouped(points, read_map.max_hole, 1 << 16)]
    if read_map.ring is not None and read_map.ring.table == table:
        size = read_map.ring.slot_size(read_map.points) * read_map.ring.samples
        blocks.append((read_map.ring.address, read_map.ring.address + size))
    if table in BIT_TABLES:  # the wire library hands out bits in groups of 16
        blocks = [(start // 16 * 16, -(-end // 16) * 16) for start, end in blocks]
    return tuple(sorted(blocks))
