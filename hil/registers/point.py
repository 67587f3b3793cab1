"""One measured or commanded value on the wire: where its registers are and what the number in them means."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from recordings import BadInput, SignalSpec

RegisterTable = Literal["holding", "input", "coil", "discrete"]
NumberType = Literal["int16", "uint16", "int32", "uint32", "float32", "float64", "bit"]
ByteOrder = Literal["ABCD", "CDAB", "BADC", "DCBA"]

REGISTERS: dict[str, int] = {"int16": 1, "uint16": 1, "int32": 2, "uint32": 2, "float32": 2, "float64": 4, "bit": 1}
"""How many 16-bit registers each type takes (in the bit tables: how many bits)."""

READ_FUNCTION: dict[str, int] = {"coil": 1, "discrete": 2, "holding": 3, "input": 4}
"""The Modbus function code that reads each table."""

BIT_TABLES = frozenset({"coil", "discrete"})


class Point(BaseModel):
    """One value of a device, as its register list describes it. Immutable; unknown keys are refused.

    name : what our side calls it; table, address : where, the address counted from 0 within its table
    ("40011" in a vendor's list is holding address 10); type : how the bits are to be read; byte_order : of the bytes
    ABCD of a 32-bit value, and likewise within 16 and 64 bits; value = raw * scale + offset, in `unit`;
    valid_range : lowest and highest believable value, in `unit`; invalid : raw values that mean "no measurement";
    unit_id : the device on the line; bit : which bit of a register, 0 the lowest, for type "bit" in a register table;
    overlap : this point may share registers with others on purpose.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z_][A-Za-z0-9_.\-]*$")]
    table: RegisterTable
    address: Annotated[int, Field(ge=0, le=65535, strict=True)]
    type: NumberType
    byte_order: ByteOrder = "ABCD"
    scale: float = 1.0
    offset: float = 0.0
    unit: str = "1"
    valid_range: tuple[float, float] | None = None
    invalid: tuple[int | float, ...] = ()
    unit_id: Annotated[int, Field(ge=1, le=247, strict=True)] = 1
    bit: Annotated[int, Field(ge=0, le=15, strict=True)] | None = None
    overlap: bool = False
    description: str = ""

    @property
    def count(self) -> int:
        """How many registers (or bits, in a bit table) the point takes."""
        return REGISTERS[self.type]

    @property
    def end(self) -> int:
        """The first address behind the point."""
        return self.address + self.count

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for problem in (self._place_problem(), self._number_problem(), self._unit_problem()):
            if problem:
                raise ValueError(problem)
        return self

    def _place_problem(self) -> str | None:
        if self.end > 65536:
            return f"{self.type} at address {self.address} runs past the last address, 65535"
        if self.table in BIT_TABLES and (self.type != "bit" or self.bit is not None):
            return f"the {self.table} table holds single bits: use type 'bit' and no key 'bit'"
        if self.table not in BIT_TABLES and (self.type == "bit") != (self.bit is not None):
            return "a bit of a register needs both type = 'bit' and bit = 0..15"
        return None

    def _number_problem(self) -> str | None:
        if not (math.isfinite(self.scale) and math.isfinite(self.offset)) or self.scale == 0.0:
            return f"scale {self.scale} and offset {self.offset} must be finite, and scale not 0"
        if self.valid_range is not None and not self.valid_range[0] < self.valid_range[1]:
            return f"valid_range {list(self.valid_range)} must be [lowest, highest]"
        whole = self.type not in {"float32", "float64"}
        wrong = [v for v in self.invalid if whole and not (math.isfinite(v) and v == int(v) and self._fits(int(v)))]
        return f"invalid value {wrong[0]} is not a raw value of type {self.type}" if wrong else None

    def _unit_problem(self) -> str | None:
        """A name that recordings know has a unit that they can convert: better said now than when recording."""
        try:
            SignalSpec(self.name, self.unit, "time" if self.name == "time" else "extra")
        except BadInput as error:
            return f"{error.found}; {error.remedy}"
        return None

    def _fits(self, raw: int) -> bool:
        bits = 1 if self.type == "bit" else 16 * self.count
        return -(1 << (bits - 1)) <= raw < (1 << bits)
