"""A small device for tests of sources and recorders: its map, and what it answers."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from link_peers import within

from hil import LinkEvent, RegisterMap, Sample, Source

MAP = RegisterMap.model_validate(
    {
        "name": "rig",
        "points": [
            {
                "name": "position",
                "table": "input",
                "address": 0,
                "type": "float32",
                "unit": "mm",
                "valid_range": [0, 50],
            },
            {"name": "counter", "table": "input", "address": 2, "type": "uint16"},
            {"name": "alarm", "table": "input", "address": 3, "type": "bit", "bit": 4},
        ],
    }
)


def words_of(value: float, counter: int = 0, alarm: int = 0) -> list[int]:
    return [*struct.unpack(">2H", struct.pack(">f", value)), counter % 65536, alarm << 4]


class Rig:
    """Answers like a device with `MAP` whose counter moves with every read."""

    def __init__(self, value: float = 12.5) -> None:
        self.value, self.n, self.silent = value, 0, set[int]()

    def __call__(self, unit: int, function: int, address: int, count: int) -> Sequence[int] | int | None:
        if unit in self.silent:
            return None
        if (function, address, count) != (4, 0, 4):
            return 2
        self.n += 1
        return words_of(self.value, self.n)


async def samples(source: Source, n: int) -> list[Sample]:
    """The next samples; events are passed over."""
    taken: list[Sample] = []
    while len(taken) < n:
        item = await within(anext(source))
        if isinstance(item, Sample):
            taken.append(item)
    return taken


async def event(source: Source, kind: str, valve: str | None = None) -> LinkEvent:
    """The next event of a kind."""
    while True:
        item = await within(anext(source))
        if isinstance(item, LinkEvent) and item.kind == kind and valve in (None, item.valve):
            return item
