"""What goes over the wire, whatever carries it: a request, what becomes of it, and why it has no answer.

No socket, no clock and no wire library here. What a reply must be before a value is taken from it is in
`hil.modbus.checks`, and how both lie on the line in `hil.modbus.framing`.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

READ_REGISTERS = (3, 4)
WRITE_COILS, WRITE_REGISTERS = 15, 16
MOST = {1: 2000, 2: 2000, 3: 125, 4: 125, WRITE_COILS: 1968, WRITE_REGISTERS: 123}
"""The protocol's limit of items in one request, by function code."""

EXCEPTIONS = {
    1: "illegal function",
    2: "illegal data address",
    3: "illegal data value",
    4: "device failure",
    5: "acknowledge",
    6: "device busy",
    8: "memory parity error",
    10: "gateway path unavailable",
    11: "gateway target does not answer",
}
BEHIND_GATEWAY = (10, 11)
"""Exceptions by which a gateway says that the device behind it is silent."""


class ReplyFault(StrEnum):
    """Why a request has no answer that can be used; the value is the word for statistics."""

    SILENCE = "timeout"
    LOST = "connection lost"
    EXCEPTION = "exception"
    TRANSACTION = "wrong transaction id"
    UNIT = "wrong unit"
    FUNCTION = "wrong function"
    LENGTH = "wrong length"
    CHECKSUM = "wrong checksum"
    FRAMING = "not Modbus"
    SURPLUS = "stray bytes"
    ECHO = "echo of the request"


class Reply(NamedTuple):
    """The verdict on one request. Two that say the same are equal, whenever they came.

    words : registers 0..65535 or bits 0/1, as many as asked for; fault, text : why there are none; exception : the
    code by which the device refused, else 0; time : monotonic [s], when the reply had come; NaN when none did.
    """

    words: tuple[int, ...] = ()
    fault: ReplyFault | None = None
    text: str = ""
    exception: int = 0
    time: float = math.nan

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Reply) and self[:4] == other[:4]

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(self[:4])

    @property
    def device_silent(self) -> bool:
        """Whether the device itself said nothing: no reply at all, or a gateway that says so."""
        return self.fault is ReplyFault.SILENCE or self.exception in BEHIND_GATEWAY


@dataclass(frozen=True, slots=True)
class Request:
    """One read or write of neighbouring registers or bits.

    unit : device id 0..255; function : code; address : from 0; count : of items; words : what a write carries, empty
    for a read; pdu : function code and data as they go out; data_bytes : the byte count that the reply to a read must
    declare; reply_length : bytes of a right reply, from the function code to the end of its data.

    Raises ValueError for what the protocol cannot say.
    """

    unit: int
    function: int
    address: int
    count: int
    words: tuple[int, ...] = ()
    pdu: bytes = field(init=False, repr=False, compare=False)
    data_bytes: int = field(init=False, repr=False, compare=False)
    reply_length: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        most = MOST.get(self.function)
        if most is None or not 1 <= self.count <= most:
            raise ValueError(f"function {self.function} cannot ask for {self.count} items")
        if not (0 <= self.unit <= 255 and 0 <= self.address <= 0x10000 - self.count):
            raise ValueError(f"unit {self.unit}, address {self.address}..{self.address + self.count - 1} do not exist")
        if len(self.words) != (self.count if self.writes else 0):
            raise ValueError(f"function {self.function} of {self.count} items carries {len(self.words)} values")
        # Worked out once: a poll sends the same request again and again.
        n_bytes = 2 * self.count if self.function in READ_REGISTERS else (self.count + 7) // 8
        object.__setattr__(self, "data_bytes", n_bytes)
        object.__setattr__(self, "reply_length", 5 if self.writes else 2 + n_bytes)
        object.__setattr__(self, "pdu", _pdu(self))

    @property
    def writes(self) -> bool:
        """Whether it changes something in the device."""
        return self.function in (WRITE_COILS, WRITE_REGISTERS)


def _pdu(request: Request) -> bytes:
    head = struct.pack(">BHH", request.function, request.address, request.count)
    if request.function == WRITE_REGISTERS:
        return head + struct.pack(f">B{request.count}H", 2 * request.count, *request.words)
    if request.function == WRITE_COILS:
        packed = sum(bool(bit) << k for k, bit in enumerate(request.words))
        return head + bytes([request.data_bytes]) + packed.to_bytes(request.data_bytes, "little")
    return head
