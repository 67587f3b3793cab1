"""The memory of last samples: a block of registers from which a slow link fetches every sample, none missed.

A ring has `samples` slots. Sample number k (counted from 0 since the start) lies in slot ``k % samples``; a slot is
the sample's number (uint32, high word first) followed by the registers of its points, so every slot says itself which
sample it holds: a slot that was overwritten, or not yet written, is recognised and never mistaken for another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from hil.registers.codec import Decoded, decode
from hil.registers.point import Point

COUNTER = 2
"""Registers of the sample number at the head of a slot."""


class Ring(BaseModel):
    """Where a device keeps its last samples, and the points of one sample, in order.

    A point's own address plays no part in the ring: only its type, byte order, scale and limits do.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    table: Literal["input", "holding"] = "input"
    address: Annotated[int, Field(ge=0, le=65535, strict=True)]
    samples: Annotated[int, Field(ge=2, le=16384, strict=True)]
    points: Annotated[tuple[str, ...], Field(min_length=1)]

    def refuse_clashes(self, points: Sequence[Point]) -> None:
        """Raise ValueError when the ring names an unknown point, is too large, or lies on top of a point."""
        known = {point.name: point for point in points}
        for k, name in enumerate(self.points):
            if name not in known:
                raise ValueError(f"ring.points[{k}]: there is no point named {name!r}; name one of the points")
            if known[name].bit is not None or known[name].table in {"coil", "discrete"}:
                raise ValueError(f"ring.points[{k}]: {name!r} is a bit; a ring holds whole registers")
        end = self.address + self.samples * self.slot_size(points)
        if end > 65536:
            raise ValueError(f"ring.samples: {self.samples} samples run past address 65535; use fewer or smaller ones")
        for point in points:
            if point.table == self.table and point.address < end and point.end > self.address:
                raise ValueError(f"ring.address: the ring, {self.address}..{end - 1}, overlaps point {point.name!r}")

    def members(self, points: Sequence[Point]) -> tuple[Point, ...]:
        """The points of one sample, in order."""
        known = {point.name: point for point in points}
        return tuple(known[name] for name in self.points)

    def slot_size(self, points: Sequence[Point]) -> int:
        """Registers of one slot, its sample number included."""
        return COUNTER + sum(point.count for point in self.members(points))

    def read_for(self, points: Sequence[Point], sample: int, most: int, max_read: int = 125) -> tuple[int, int, int]:
        """The one read that fetches samples from number `sample` on: address, registers, and how many samples.

        It stops at `most` samples, at `max_read` registers, and at the end of the ring's block (the next read
        starts over at its beginning).
        """
        size, slot = self.slot_size(points), sample % self.samples
        n = max(1, min(most, max_read // size, self.samples - slot))
        return self.address + slot * size, n * size, n

    def decode(self, points: Sequence[Point], sample: int, reply: Sequence[int]) -> list[Mapping[str, Decoded] | None]:
        """The samples of a reply that was read from number `sample` on; None for a slot that holds another sample."""
        size, members = self.slot_size(points), self.members(points)
        slots = [reply[k : k + size] for k in range(0, len(reply) - size + 1, size)]
        return [_slot(members, sample + k, slot) for k, slot in enumerate(slots)]


def _slot(members: Sequence[Point], sample: int, slot: Sequence[int]) -> Mapping[str, Decoded] | None:
    if (slot[0] << 16) + slot[1] != sample & 0xFFFFFFFF:
        return None
    values, start = {}, COUNTER
    for point in members:
        values[point.name] = decode(point, slot[start : start + point.count])
        start += point.count
    return values
