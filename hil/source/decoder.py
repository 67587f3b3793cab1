"""The readings of a whole reply at once: one unpacking for all numbers that are plainly good, `decode` for all others.

Polling spends most of its time on values, so the ordinary case is prepared once a block: numbers of the byte orders
ABCD and CDAB are unpacked together, scaled and compared with their limits. Whatever is not within them, marked as
invalid, a bit or of another byte order goes to `decode`, which also finds the reason. The short cut can therefore only
accept, and a test holds it against `decode` on every kind of point.
"""

from __future__ import annotations

import math
import struct
import sys
from collections.abc import Sequence

from hil.registers.codec import decode
from hil.registers.point import BIT_TABLES, Point
from hil.registers.register_map import ReadBlock
from hil.source.sample import Quality, Reading

_CODE = {"int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f", "float64": "d"}
_FLOATS = ("float32", "float64")


class BlockDecoder:
    """Turns the registers or bits of a block's reply into readings by point name.

    >>> import struct
    >>> level = Point(name="level", table="input", address=7, type="float32", unit="%", valid_range=(0, 100))
    >>> decoder = BlockDecoder(ReadBlock(1, "input", 7, 2, (level,)))
    >>> decoder.readings(struct.unpack(">2H", struct.pack(">f", 62.5)))["level"].value
    62.5
    """

    def __init__(self, block: ReadBlock) -> None:
        self._points = [(point, point.address - block.address) for point in block.points]
        plain = [(point, start) for point, start in self._points if _plain(point)]
        self._order = [start + word for point, start in plain for word in _word_order(point)]
        self._pack = struct.Struct(f">{len(self._order)}H").pack
        self._unpack = struct.Struct(">" + "".join(_CODE[point.type] for point, _ in plain)).unpack
        self._limits = [(point.name, point.unit, point.scale, point.offset, *_limits(point)) for point, _ in plain]
        names = {point.name for point, _ in plain}
        self._other = [(point, start) for point, start in self._points if point.name not in names]
        self._place = {point.name: (point, start) for point, start in plain}

    def readings(self, words: Sequence[int], time: float = math.nan) -> dict[str, Reading]:
        """The readings of a reply of the block's length. time : when it came, monotonic [s]."""
        raw = self._unpack(self._pack(*[words[k] for k in self._order]))
        readings: dict[str, Reading] = {}
        for number, (name, unit, scale, offset, lowest, highest, marked) in zip(raw, self._limits, strict=True):
            value = number * scale + offset
            if lowest <= value <= highest and number not in marked:
                readings[name] = Reading(value, unit, Quality.GOOD, None, time)
            else:
                readings[name] = _reading(*self._place[name], words, time)
        for point, start in self._other:
            readings[point.name] = _reading(point, start, words, time)
        return readings

    def bad(self, reason: str, quality: Quality = Quality.LINK) -> dict[str, Reading]:
        """Readings without values."""
        return {point.name: Reading(math.nan, point.unit, quality, reason) for point, _ in self._points}


def _plain(point: Point) -> bool:
    ordered = point.byte_order in ("ABCD", "CDAB")
    return ordered and point.table not in BIT_TABLES and point.type in _CODE and not _needs_closeness(point)


def _needs_closeness(point: Point) -> bool:
    """Invalid values of floats are compared with a tolerance, which only `decode` knows."""
    return point.type in _FLOATS and bool(point.invalid)


def _word_order(point: Point) -> Sequence[int]:
    words = range(point.count)
    return words if point.byte_order == "ABCD" else words[::-1]


def _limits(point: Point) -> tuple[float, float, frozenset[int]]:
    """Lowest and highest value that is good, and the raw values that are not, in both their spellings."""
    lowest, highest = point.valid_range or (-math.inf, math.inf)
    largest = sys.float_info.max
    span = 1 << 16 * point.count
    marked = {spelling for marker in point.invalid for spelling in (int(marker) % span, int(marker) % span - span)}
    return max(lowest, -largest), min(highest, largest), frozenset(marked)


def _reading(point: Point, start: int, words: Sequence[int], time: float) -> Reading:
    return Reading.of(decode(point, words[start : start + point.count]), point.unit, time)
