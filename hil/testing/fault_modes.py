"""Each way in which a reply can go wrong: one function from a frame to what the client gets to see of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from random import Random
from typing import Literal, get_args

from hil.modbus.framing import Frame
from hil.testing.frame_cutter import Framing, built, parsed

Mode = Literal[
    "delay",
    "jitter",
    "drop",
    "duplicate",
    "truncate",
    "wrong_unit",
    "wrong_function",
    "wrong_transaction",
    "wrong_count",
    "bad_check",
    "exception",
    "silence",
    "close",
    "garbage",
    "drip",
]
MODES: tuple[Mode, ...] = get_args(Mode)

EXCEPTIONS = (1, 2, 3, 4, 5, 6, 8, 10, 11, 0, 77)
"""The exception codes of the standard, and two that no standard knows."""


@dataclass(frozen=True)
class Send:
    """Bytes towards the client, `after` seconds after what came before."""

    data: bytes
    after: float = 0.0


@dataclass(frozen=True)
class Close:
    """The end of the connection."""


Action = Send | Close


@dataclass(frozen=True)
class Case:
    """A whole reply frame and what a mode may need besides it; times in seconds."""

    frame: bytes
    framing: Framing
    random: Random
    delay_s: float
    jitter_s: float
    drip_s: float

    def rebuilt(self, **changes: int | bytes) -> list[Action]:
        """The reply with some of its parts changed, in a frame that is right in itself."""
        return [Send(built(self.framing, self.reply._replace(**changes)))]  # type: ignore[arg-type]

    @property
    def reply(self) -> Frame:
        """The reply in the frame."""
        return parsed(self.framing, self.frame)


def _delay(case: Case) -> list[Action]:
    return [Send(case.frame, case.delay_s)]


def _jitter(case: Case) -> list[Action]:
    return [Send(case.frame, case.random.uniform(0.0, case.jitter_s))]


def _nothing(_case: Case) -> list[Action]:
    return []


def _duplicate(case: Case) -> list[Action]:
    return [Send(case.frame), Send(case.frame)]


def _truncate(case: Case) -> list[Action]:
    return [Send(case.frame[: case.random.randrange(1, len(case.frame))])]


def _wrong_unit(case: Case) -> list[Action]:
    return case.rebuilt(unit=_other(case, case.reply.unit, range(1, 248)))


def _wrong_function(case: Case) -> list[Action]:
    pdu = case.reply.pdu
    return case.rebuilt(pdu=bytes([_other(case, pdu[0], (1, 2, 3, 4, 5, 6, 15, 16))]) + pdu[1:])


def _wrong_transaction(case: Case) -> list[Action]:
    """One in four is 0, which some clients take for any."""
    wrong = _other(case, case.reply.transaction, range(1, 1 << 16))
    return case.rebuilt(transaction=0 if case.random.random() < 0.25 and case.reply.transaction else wrong)


def _wrong_count(case: Case) -> list[Action]:
    """Registers missing or too many, with a byte count that fits them; replies to writes have no count to be wrong."""
    pdu = case.reply.pdu
    if pdu[0] not in {1, 2, 3, 4} or len(pdu) < 2:
        return _truncate(case)
    data = pdu[2:]
    changed = data[:-2] if len(data) > 2 and case.random.random() < 0.5 else data + case.random.randbytes(2)
    return case.rebuilt(pdu=bytes([pdu[0], len(changed)]) + changed)


def _bad_check(case: Case) -> list[Action]:
    """A wrong checksum; TCP has none, there the protocol is another one."""
    frame, at = bytearray(case.frame), 2 if case.framing == "tcp" else len(case.frame) - 2
    frame[at] ^= case.random.randrange(1, 256)
    return [Send(bytes(frame))]


def _exception(case: Case) -> list[Action]:
    return case.rebuilt(pdu=bytes([case.reply.pdu[0] | 0x80, case.random.choice(EXCEPTIONS)]))


def _close(_case: Case) -> list[Action]:
    return [Close()]


def _garbage(case: Case) -> list[Action]:
    noise = case.random.randbytes(case.random.randrange(1, 41))
    return [Send(case.random.choice((noise, noise + case.frame, case.frame + noise)))]


def _drip(case: Case) -> list[Action]:
    return [Send(case.frame[k : k + 1], case.drip_s) for k in range(len(case.frame))]


def _other(case: Case, value: int, choices: range | tuple[int, ...]) -> int:
    while (other := case.random.choice(choices)) == value:
        pass
    return other


FAULTS: Mapping[Mode, Callable[[Case], list[Action]]] = {
    "delay": _delay,
    "jitter": _jitter,
    "drop": _nothing,
    "duplicate": _duplicate,
    "truncate": _truncate,
    "wrong_unit": _wrong_unit,
    "wrong_function": _wrong_function,
    "wrong_transaction": _wrong_transaction,
    "wrong_count": _wrong_count,
    "bad_check": _bad_check,
    "exception": _exception,
    "silence": _nothing,
    "close": _close,
    "garbage": _garbage,
    "drip": _drip,
}
