"""One served device: a plant behind registers. Addresses and words in, words or a refusal out; no socket, no clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum

import numpy as np

from hil.plant.pace import LatenessReport, Pace
from hil.plant.plant import ServedPlant
from hil.registers.codec import decode, saturated
from hil.server.layout import ServedPoint, ServedRegisters
from hil.server.sample_memory import SampleMemory
from recordings import BadInput

MOST_AT_ONCE = 400
"""Samples simulated in one go while following the clock: between two goes the server answers requests."""

LONGEST_ADVANCE = 65535
"""Samples of one lock-step advance when there is no ring to overrun."""

LATE = 0.1
"""Behind the clock by more than this [s], the status says late."""


class Refusal(IntEnum):
    """Why a request is refused: exception codes of the Modbus application protocol, section 7."""

    ILLEGAL_FUNCTION = 1
    ILLEGAL_ADDRESS = 2
    ILLEGAL_VALUE = 3


class Refused(Exception):
    """A request that gets an exception as its answer. It stays within the server, so no `BristleError`."""

    def __init__(self, code: Refusal) -> None:
        super().__init__(code.name)
        self.code = code


class ServedUnit:
    """A plant behind the registers of a layout.

    plant : what is served; layout : from `layout(plant, ...)`; pace : follows the clock, None for lock-step;
    harm : whether registers may switch on what damages the plant.
    """

    def __init__(self, plant: ServedPlant, layout: ServedRegisters, pace: Pace | None, harm: bool = False) -> None:
        self.plant, self.layout, self.pace, self._harm = plant, layout, pace, harm
        self.samples = 0
        self.requests = self.refused = 0
        self._running = False
        self._last_advance = 1
        ring = layout.read_map.ring
        self._memory = SampleMemory(layout.ring_places, ring.samples) if ring else None
        self._remember(0, self._present())

    def follow(self, clock: Callable[[], float]) -> int:
        """Simulate what is due by a monotonic clock [s], `MOST_AT_ONCE` samples at most; returns how many it was."""
        if self.pace is None:
            return 0
        n = min(self.pace.due(clock()), MOST_AT_ONCE)
        if n:
            self.advance(n)
            self.pace.done(n, clock())
        return n

    def advance(self, n_samples: int) -> None:
        """Simulate `n_samples` more."""
        samples = self.plant.advance(n_samples)
        self._remember(self.samples + 1, samples)
        self.samples += n_samples

    def run(self, running: bool, now: float) -> None:
        """Let plant time follow the clock from now on, or hold it; in lock-step it moves only when told to."""
        self._running = running
        if self.pace is not None:
            (self.pace.release if running else self.pace.hold)(now)

    def report(self) -> LatenessReport | None:
        """Lateness so far; None in lock-step."""
        return self.pace.report() if self.pace else None

    def read(self, table: str, address: int, count: int) -> list[int]:
        """The registers (bits, 0 or 1) from an address on. Raises Refused for addresses that do not exist."""
        self.requests += 1
        if not self.layout.is_legal(table, address, count):
            raise self._refusal(Refusal.ILLEGAL_ADDRESS)
        ring = self.layout.read_map.ring
        if self._memory and ring and table == ring.table and self.layout.in_ring(address):
            return self._memory.words(address - ring.address, count)
        words = [0] * count
        _fill(words, address, self.layout.writable[table], self._settings)
        _fill(words, address, self.layout.readable[table], self._signals)
        return words

    def write(self, table: str, address: int, words: Sequence[int], now: float) -> None:
        """Carry out a write of whole points, all of it or nothing. Raises Refused."""
        self.requests += 1
        changes: dict[str, float] = {}
        for place in self._covered(table, address, len(words)):
            start = place.point.address - address
            value = decode(place.point, words[start : start + place.point.count]).value
            if value is None:
                raise self._refusal(Refusal.ILLEGAL_VALUE)
            changes[place.point.name] = place.to_plant(value)
        n_samples = self._checked_advance(changes)
        self._apply({name: value for name, value in changes.items() if name in self.plant.commands})
        if changes.get("reset"):
            self._reset()
        if "run" in changes:
            self.run(bool(changes["run"]), now)
        if n_samples:
            self._last_advance = n_samples
            self.advance(n_samples)

    def _reset(self) -> None:
        """The plant at time 0 is a sample of its own: numbers never go back."""
        self.plant.reset()
        self.samples += 1
        self._remember(self.samples, self._present())

    def _present(self) -> Mapping[str, np.ndarray]:
        return {name: np.array([value]) for name, value in self.plant.signals().items()}

    def _covered(self, table: str, address: int, count: int) -> list[ServedPoint]:
        """The places that a write covers; it must cover whole points, no hole, and nothing that is off limits."""
        end = address + count
        places = [p for p in self.layout.writable[table] if p.point.address < end and p.point.end > address]
        whole = all(address <= p.point.address and p.point.end <= end for p in places)
        covered = {a for p in places for a in range(p.point.address, p.point.end)}
        if not whole or len(covered) != count or (not self._harm and any(p.harmful for p in places)):
            raise self._refusal(Refusal.ILLEGAL_ADDRESS)
        return places

    def _checked_advance(self, changes: Mapping[str, float]) -> int:
        if "advance" not in changes:
            return 0
        if self.pace is not None:
            raise self._refusal(Refusal.ILLEGAL_FUNCTION)
        n_samples, most = int(changes["advance"]), self._memory.slots if self._memory else LONGEST_ADVANCE
        if not 1 <= n_samples <= most:
            raise self._refusal(Refusal.ILLEGAL_VALUE)
        return n_samples

    def _apply(self, changes: Mapping[str, float]) -> None:
        try:
            if changes:
                self.plant.apply(changes)
        except BadInput:
            raise self._refusal(Refusal.ILLEGAL_VALUE) from None

    def _refusal(self, code: Refusal) -> Refused:
        self.refused += 1
        return Refused(code)

    def _remember(self, first: int, samples: Mapping[str, np.ndarray]) -> None:
        if self._memory is None:
            return
        n = len(next(iter(samples.values())))
        numbers = {"sample_counter": np.arange(first, first + n, dtype=float)}
        self._memory.remember(first, {**numbers, **samples})

    def _settings(self) -> Mapping[str, float]:
        own = {"advance": float(self._last_advance), "run": float(self._running), "reset": 0.0}
        return {**own, **self.plant.settings()}

    def _signals(self) -> Mapping[str, float]:
        """The plant's signals and the server's own."""
        plant, report = self.plant.signals(), self.report()
        flags = {
            "running": self._running,
            "lock_step": self.pace is None,
            "fault_active": bool(plant.get("fault_active", 0.0)),
            "late": self.pace is not None and self.pace.behind > LATE,
        }
        return {
            "sample_counter": float(self.samples),
            "step": self.plant.step_s,
            "status": float(sum(flag << bit for bit, flag in enumerate(flags.values()))),
            "lateness_p50": report.p50 if report else 0.0,
            "lateness_p99": report.p99 if report else 0.0,
            "lateness_max": report.maximum if report else 0.0,
            **plant,
            **{name: float(flag) for name, flag in flags.items()},
        }


def _fill(
    words: list[int], address: int, places: Sequence[ServedPoint], values: Callable[[], Mapping[str, float]]
) -> None:
    """Put the registers of the places that lie in the window into `words`; bits of one register are joined."""
    end = address + len(words)
    wanted = [p for p in places if p.point.address < end and p.point.end > address]
    present = values() if wanted else {}
    for place in wanted:
        point = place.point
        for offset, word in enumerate(saturated(point, _wrapped(place, present[point.name]))):
            at = point.address + offset - address
            if 0 <= at < len(words):
                words[at] = words[at] | word if point.bit is not None else word


def _wrapped(place: ServedPoint, value: float) -> float:
    """A value as the point has it; counters begin again at 0 when their register is full."""
    if place.point.name == "sample_counter" and place.point.type in {"int16", "uint16", "int32", "uint32"}:
        bits = 16 * place.point.count - (place.point.type in {"int16", "int32"})
        return float(int(value) % (1 << bits))
    return place.from_plant(value)
