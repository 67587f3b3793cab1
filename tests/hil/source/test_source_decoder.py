"""Replies into readings: the short cut for plainly good numbers takes nothing that `decode` would not."""

from __future__ import annotations

from random import Random

import pytest

from hil import Point, ReadBlock, decode
from hil.source.decoder import BlockDecoder


@pytest.mark.parametrize("kind", ["int16", "uint16", "int32", "uint32", "float32", "float64"])
@pytest.mark.parametrize("order", ["ABCD", "CDAB", "BADC", "DCBA"])
def test_a_block_is_decoded_as_its_points_are(kind, order):
    """The short cut for plainly good numbers against `decode`, on random and on marked registers."""
    random = Random(f"{kind} {order}")
    floats = kind.startswith("float")
    common = {"table": "holding", "type": kind, "byte_order": order, "scale": 0.5, "offset": 3.0}
    size = Point(name="x", address=0, **common).count
    points = [
        Point(name="free", address=5, **common),
        Point(name="limited", address=5 + size, valid_range=(-1e3, 1e4), **common),
        Point(name="marked", address=5 + 2 * size, invalid=(-1.0,) if floats else (-1, 7), **common),
        Point(name="bit", address=5 + 3 * size, table="holding", type="bit", bit=11),
    ]
    block = ReadBlock(1, "holding", 5, 3 * size + 1, tuple(points))
    decoder = BlockDecoder(block)
    for _ in range(400):
        words = [random.choice((0, 1, 7, 0xFFFF, 0x7FC0, 0x8000, random.getrandbits(16))) for _ in range(block.count)]
        readings = decoder.readings(words)
        for point in points:
            wanted = decode(point, block.registers_of(point, words))
            got = readings[point.name]
            assert (got.usable if wanted.value is not None else None) == wanted.value
            assert got.reason == wanted.reason
            assert got.unit == point.unit


def test_bits_of_a_bit_table_are_decoded():
    points = (
        Point(name="a", table="coil", address=3, type="bit"),
        Point(name="b", table="coil", address=5, type="bit"),
    )
    readings = BlockDecoder(ReadBlock(1, "coil", 3, 3, points)).readings((1, 1, 0))
    assert (readings["a"].value, readings["b"].value) == (1.0, 0.0)
