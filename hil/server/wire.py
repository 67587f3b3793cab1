"""Served devices on pymodbus: the one place that knows how this wire library wants its registers.

The library owns framing, function codes and exceptions. Every access ends in `answer`, which never awaits: a request is
answered as a whole before the next is looked at, and a block of registers is one consistent moment of the plant.
"""

from __future__ import annotations

import functools
import logging
import time
from collections.abc import Callable, Mapping, Sequence

from pymodbus.constants import ExcCodes
from pymodbus.simulator import DataType, SimData, SimDevice

from hil.server.unit import Refused, ServedUnit

logging.getLogger("pymodbus").addHandler(logging.NullHandler())  # a peer's garbage is its own affair, not our stderr's

_TABLE = {1: "coil", 5: "coil", 15: "coil", 2: "discrete", 4: "input", 3: "holding", 6: "holding", 16: "holding"}
_TABLE.update({22: "holding", 23: "holding"})

_BITS = ("coil", "discrete")

Clock = Callable[[], float]


def devices(units: Mapping[int, ServedUnit], clock: Clock = time.monotonic) -> list[SimDevice]:
    """The devices of one server, by unit id; each server needs its own."""
    return [_device(unit_id, unit, clock) for unit_id, unit in units.items()]


def _device(unit_id: int, unit: ServedUnit, clock: Clock) -> SimDevice:
    size = unit.layout.size
    coils, discretes = ([SimData(0, values=[False] * size(t), datatype=DataType.BITS)] for t in _BITS)
    holding, inputs = ([SimData(0, values=[0] * size(t), datatype=DataType.REGISTERS)] for t in ("holding", "input"))
    blocks = (coils, discretes, holding, inputs)
    return SimDevice(unit_id, simdata=blocks, action=functools.partial(_answer, unit, clock))


async def _answer(
    unit: ServedUnit,
    clock: Clock,
    function_code: int,
    start: int,
    address: int,
    count: int,
    registers: list[int],
    new: Sequence[int | bool] | None,
) -> ExcCodes | None:
    """Serve one access: live values into `registers` (whose first has address `start`), or `new` to the plant."""
    table = _TABLE[function_code]
    unit.follow(clock)
    try:
        if new is not None:
            unit.write(table, address, [int(value) for value in new], clock())
        elif table in _BITS:
            first = address // 16
            bits = unit.read(table, 16 * first, 16 * count)
            registers[first - start : first - start + count] = _packed(bits)
        else:
            registers[address - start : address - start + count] = unit.read(table, address, count)
    except Refused as refused:
        return ExcCodes(refused.code)
    return None


def _packed(bits: Sequence[int]) -> list[int]:
    """Bits to registers as the library keeps them, the lowest bit first."""
    return [sum(bit << k for k, bit in enumerate(bits[n : n + 16])) for n in range(0, len(bits), 16)]
