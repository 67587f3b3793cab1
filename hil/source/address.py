"""The address of a source: one line of text says where the values come from and how.

    tcp://HOST:PORT                                    Modbus TCP; port 502 when not given
    tls://HOST:PORT?ca=..&cert=..&key=..               Modbus/TCP Security, both sides show certificates; port 802
    rtu:/dev/ttyUSB0?baud=19200&parity=E               Modbus RTU on a serial line
    replay:REC.h5?pace=1                               a recording played back; without pace as fast as possible

All live ones take `timeout` [s], and rtu takes `stop` bits and `quiet` [s], the silence after a fault.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar, Self

from hil.client.transport import LiveAddress
from hil.modbus.addresses import AddressParts
from recordings import BadInput, classes_of


@dataclass(frozen=True)
class ReplayAddress:
    """A recording. pace : times real time; None plays as fast as possible."""

    scheme: ClassVar[str] = "replay"
    form: ClassVar[str] = "replay:REC.h5"

    text: str
    path: Path
    pace: float | None = None

    @classmethod
    def of(cls, parts: AddressParts) -> Self:
        """Read an address. Raises BadInput naming what is wrong in it."""
        parts.options.only("pace")
        if not parts.place:
            raise BadInput(parts.text, "there is no recording in it", f"write {cls.form}")
        pace = parts.options.number("pace", 1.0, 1e-3, 1e6) if parts.options.word("pace") is not None else None
        return cls(parts.text, Path(parts.place), pace)


Address = LiveAddress | ReplayAddress


def parse_address(text: str) -> Address:
    """The address that a text means. Raises BadInput naming what is wrong in it.

    >>> parse_address("rtu:/dev/ttyUSB0?baud=9600&parity=N").line.gap
    0.0036458333333333334
    >>> parse_address("tcp://10.0.0.7").port
    502
    """
    scheme, kinds = text.partition(":")[0], _kinds()
    if ":" not in text or scheme not in kinds:
        forms = [kind.form for kind in kinds.values()]
        remedy = f"write {', '.join(forms[:-1])} or {forms[-1]}"
        raise BadInput(text, f"'{scheme}' is not a kind of source", remedy)
    return kinds[scheme].of(AddressParts.of(text))


def live_address(text: str) -> LiveAddress:
    """The address of a device. Raises BadInput for a recording, which has no registers, and as `parse_address`."""
    where = parse_address(text)
    if isinstance(where, ReplayAddress):
        raise BadInput(
            text, "it is a recording, which has no registers", f"see what it holds: bristle show {where.path}"
        )
    return where


@cache
def _kinds() -> Mapping[str, type[Address]]:
    """The transports that the modules of `hil.client` define, and the replay, by scheme."""
    live: list[type[Address]] = list(classes_of("hil.client", LiveAddress))  # type: ignore[type-abstract]
    return {kind.scheme: kind for kind in (*live, ReplayAddress)}
