"""From registers to engineering values and back. Nothing here knows a socket; every wrong input has its reason.

Decoding never invents a number: whatever is not certainly the value gives None and says why.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from hil.registers.point import BIT_TABLES, Point
from recordings import BadInput

_FORMAT = {"int16": ">h", "uint16": ">H", "int32": ">i", "uint32": ">I", "float32": ">f", "float64": ">d"}
_UNSIGNED = {"int16": ">H", "int32": ">I"}


@dataclass(frozen=True)
class Decoded:
    """What a reply said about one point: a value in the point's unit, or None and the reason in words.

    out_of_range : whether it is a number, but none that the map allows.
    """

    value: float | None
    reason: str | None = None
    out_of_range: bool = False


def decode(point: Point, registers: Sequence[int | bool]) -> Decoded:
    """The engineering value in a point's registers (`point.count` numbers 0..65535, or one bit of a bit table).

    None with a reason when the raw value is one that the map calls invalid, or the value is not finite or outside the
    valid range, or the registers are not what the point needs. Never raises.

    >>> level = Point(name="level", table="input", address=0, type="int16", scale=0.1, unit="%", invalid=(0x8000,))
    >>> decode(level, [505]).value
    50.5
    >>> decode(level, [0x8000]).reason
    'raw value 32768 means invalid'
    """
    if len(registers) != point.count:
        return Decoded(None, f"{len(registers)} registers instead of {point.count}")
    top = 1 if point.table in BIT_TABLES else 0xFFFF
    if not all(isinstance(word, int) and 0 <= word <= top for word in registers):
        return Decoded(None, f"a register outside 0..{top}")
    words = [int(word) for word in registers]
    raw = _bit(point, words[0]) if point.type == "bit" else _number(point, words)
    marked = _marked(point, raw)
    if marked is not None:
        return Decoded(None, f"raw value {marked} means invalid")
    return _in_range(point, raw * point.scale + point.offset)


def encode(point: Point, value: float) -> list[int]:
    """The registers (or the bit) that carry a value in the point's unit; integers are rounded to the nearest step.

    Raises BadInput for whatever `decode` would not give back as good: not finite, outside the valid range or the
    type, equal to an invalid marker.

    >>> encode(Point(name="p", table="holding", address=0, type="float32", byte_order="CDAB"), 1.0)
    [0, 16256]
    """
    if not math.isfinite(value):
        raise _refusal(point, value, "give a finite number")
    raw = (value - point.offset) / point.scale
    lowest, highest = point.valid_range or (-math.inf, math.inf)
    if not lowest <= value <= highest:
        raise _refusal(point, value, f"allowed is {lowest:g} to {highest:g} {point.unit}")
    try:
        words = _words(point, raw)
    except (struct.error, OverflowError):
        raise _refusal(point, value, f"type {point.type} cannot hold the raw value {raw:g}; check scale") from None
    decoded = decode(point, words)
    if decoded.value is None:
        raise _refusal(point, value, f"the registers would read as bad: {decoded.reason}")
    return words


def saturated(point: Point, value: float) -> list[int]:
    """As a transmitter would send it: the nearest raw value the type holds; no number becomes the invalid marker.

    Without a marker a float sends NaN, and an integer its lowest raw value. The valid range plays no part: it is the
    reader's judgement.
    """
    if math.isnan(value):
        return _missing(point)
    raw = (value - point.offset) / point.scale
    if point.type == "float64":
        return _words(point, raw)
    lowest, highest = _limits(point)
    return _words(point, min(max(raw, lowest), highest))


def _missing(point: Point) -> list[int]:
    if point.invalid:
        bits = 1 if point.type == "bit" else 16 * point.count
        marker = point.invalid[0]
        if point.type in _UNSIGNED:
            return _split(point, (int(marker) % (1 << bits)).to_bytes(bits // 8, "big"))
        return _words(point, marker)
    if point.type in {"float32", "float64"}:
        return _split(point, struct.pack(_FORMAT[point.type], math.nan))
    return _words(point, _limits(point)[0])


def _limits(point: Point) -> tuple[float, float]:
    """Lowest and highest raw value of the type."""
    if point.type == "float32":
        largest = float(struct.unpack(">f", b"\x7f\x7f\xff\xff")[0])
        return -largest, largest
    bits = 1 if point.type == "bit" else 16 * point.count
    return (-(2.0 ** (bits - 1)), 2.0 ** (bits - 1) - 1) if point.type in _UNSIGNED else (0.0, 2.0**bits - 1)


def _words(point: Point, raw: float) -> list[int]:
    """Raw value to registers. Raises struct.error or OverflowError when the type cannot hold it."""
    if point.type in {"float32", "float64"}:
        return _split(point, struct.pack(_FORMAT[point.type], raw))
    whole = round(raw)
    if point.type != "bit":
        return _split(point, struct.pack(_FORMAT[point.type], whole))
    if whole not in {0, 1}:
        raise OverflowError(whole)
    return [whole] if point.bit is None else _split(point, struct.pack(">H", whole << point.bit))


def _split(point: Point, data: bytes) -> list[int]:
    return list(struct.unpack(f">{len(data) // 2}H", _swapped(point, data)))


def _ordered(point: Point, words: Sequence[int]) -> bytes:
    """The bytes of a value in the order ABCD."""
    return _swapped(point, struct.pack(f">{len(words)}H", *words))


def _swapped(point: Point, data: bytes) -> bytes:
    """Between the device's byte order and ABCD; each order is its own inverse."""
    if point.byte_order in {"CDAB", "DCBA"}:
        data = b"".join(data[k : k + 2] for k in range(len(data) - 2, -1, -2))
    if point.byte_order in {"BADC", "DCBA"}:
        data = b"".join(data[k : k + 2][::-1] for k in range(0, len(data), 2))
    return data


def _number(point: Point, words: Sequence[int]) -> int | float:
    return struct.unpack(_FORMAT[point.type], _ordered(point, words))[0]


def _bit(point: Point, word: int) -> int:
    return word if point.bit is None else struct.unpack(">H", _ordered(point, [word]))[0] >> point.bit & 1


def _marked(point: Point, raw: float) -> int | float | None:
    """The invalid value that a raw value equals: of integers signed and unsigned spellings mean the same bits."""
    for marker in point.invalid:
        if point.type in {"float32", "float64"}:
            same = math.isclose(raw, marker, rel_tol=1e-6) or raw == marker
        else:
            same = (int(raw) - int(marker)) % (1 << (1 if point.type == "bit" else 16 * point.count)) == 0
        if same:
            return marker
    return None


def _in_range(point: Point, value: float) -> Decoded:
    if not math.isfinite(value):
        return Decoded(None, f"not finite ({value})")
    if point.valid_range is not None and not point.valid_range[0] <= value <= point.valid_range[1]:
        lowest, highest = point.valid_range
        return Decoded(None, f"{value:g} outside {lowest:g} to {highest:g} {point.unit}", out_of_range=True)
    return Decoded(value)


def _refusal(point: Point, value: float, remedy: str) -> BadInput:
    return BadInput(f"point {point.name!r}", f"{value:g} {point.unit} cannot be sent", remedy)
