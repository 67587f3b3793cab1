"""A valve as a source sees it: a name, the map of its registers, and what a recording of it declares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from hil.modbus.messages import Reply, ReplyFault, Request
from hil.registers.point import Point
from hil.registers.register_map import ReadBlock, RegisterMap
from hil.source.decoder import BlockDecoder
from hil.source.sample import Quality, Reading
from recordings import BadInput, Role, SignalSpec

_ROLES: dict[str, Role] = {
    "setpoint": "input",
    "drive": "input",
    "pressure": "input",
    "force": "input",
    "position": "output",
}
"""What drives a valve and what it answers with; every other point is carried along."""


@dataclass(frozen=True)
class Valve:
    """One valve on the line. name : its tag, in events and file names; map : where to read what.

    >>> Valve("LC74_20", RegisterMap.load("damadics")).units
    (1,)
    """

    name: str
    map: RegisterMap

    def __post_init__(self) -> None:
        if not self.name or "/" in self.name or not self.name.isprintable() or self.name.startswith("."):
            remedy = "use letters, digits, '_', '-' and '.': it becomes part of a file name"
            raise BadInput("valve", f"'{self.name}' cannot be the name of a valve", remedy)

    @cached_property
    def reads(self) -> tuple[BlockRead, ...]:
        """The requests of one poll."""
        return tuple(BlockRead(block) for block in self.map.reads())

    @property
    def units(self) -> tuple[int, ...]:
        """The device ids that are asked."""
        return tuple(sorted({point.unit_id for point in self.map.points}))

    def signals(self, names: Sequence[str] | None = None) -> tuple[SignalSpec, ...]:
        """What a recording of the named points declares, of all when none are named, in their order, time first.

        Raises BadInput when a point has the name of the recording's clock.
        """
        points = self.map.points if names is None else [self.map.point(name) for name in names]
        return (SignalSpec("time", "s", "time"), *(self._signal(point) for point in points))

    def _signal(self, point: Point) -> SignalSpec:
        if point.name == "time":
            where = f"register map '{self.map.name}': point 'time'"
            raise BadInput(where, "'time' is the name of the recording's own clock", "rename the point")
        whole = point.type not in {"float32", "float64", "bit"}
        return SignalSpec(
            point.name,
            point.unit,
            _ROLES.get(point.name, "extra"),
            description=point.description or None,
            resolution=abs(point.scale) if whole else None,
        )


class BlockRead:
    """One read of a poll: the request, and what each part of its reply means."""

    def __init__(self, block: ReadBlock) -> None:
        self.request = Request(block.unit_id, block.function_code, block.address, block.count)
        self._decoder = BlockDecoder(block)

    def readings(self, reply: Reply) -> dict[str, Reading]:
        """The readings of a reply by point name; all bad, with the reason, when it has a fault."""
        if reply.fault is None:
            return self._decoder.readings(reply.words, reply.time)
        refused = reply.fault is ReplyFault.EXCEPTION and not reply.device_silent
        return self._decoder.bad(reply.text, Quality.NOT_VALID if refused else Quality.LINK)

    def bad(self, reason: str) -> dict[str, Reading]:
        """Readings without values, when the request was not sent."""
        return self._decoder.bad(reason)


def valves_of(register_map: RegisterMap, units: Sequence[int] = (), names: Sequence[str] = ()) -> tuple[Valve, ...]:
    """The valves of a map: itself, or one on each of the given device ids; named after the map unless names are given.

    >>> [valve.name for valve in valves_of(RegisterMap.load("damadics"), units=(1, 2))]
    ['damadics-1', 'damadics-2']
    """
    maps = [register_map.on_unit(unit) for unit in units] or [register_map]
    if len(set(units)) < len(units):
        raise BadInput("units", "a unit is named twice", "name each unit once")
    if names and len(names) != len(maps):
        found = f"{len(names)} names for {len(maps)} valves"
        raise BadInput("valve names", found, "give one name for each unit, in the same order")
    if len(set(names)) < len(names):
        raise BadInput("valve names", "two valves share a name", "give each its own")
    own = [f"{register_map.name}-{unit}" for unit in units] if len(units) > 1 else [register_map.name]
    return tuple(Valve(name, one) for name, one in zip(names or own, maps, strict=True))
