"""Faults simulated to learn signatures from: other seeds, strengths, onsets and growth than are judged."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from detector.evaluation.benchmark.runs import Setting, with_fault
from recordings import Array
from simulator.damadics import FAULTS, LEVELS, FaultKind, Form

SEEDS = 50_000
"""Seeds of examples begin here; judged runs stay below."""

_AFTER_S = 600
_SLOW_S = 7200.0
"""A fault that takes longer than this to grow is known by its first traces, and by its strengths held."""

_FOLLOWED_S = 4200.0
_QUICK, _DAYS, _HELD = (3600.0, 7200.0), (43_200.0, 172_800.0), (0.02, 1.0)
_AROUND = 0.06


@dataclass(frozen=True)
class Example:
    """One fault to simulate. number : 1 to 19; strength : final; onset_s, grows_s, duration_s [s]."""

    number: int
    strength: float
    onset_s: float
    grows_s: float
    duration_s: float
    seed: int = 0

    @property
    def name(self) -> str:
        """What the run is called."""
        return f"f{self.number} {self.strength:.2f} seed {self.seed}"

    def run(self, form: Form, rate: int) -> Array:
        """Signals once a second (n, 6)."""
        setting = Setting(form, self.seed)
        return with_fault(
            self.number, self.strength, setting, onset_s=self.onset_s, grows_s=self.grows_s,
            duration_s=self.duration_s, rates=(rate,),
        )[rate]  # fmt: skip


def examples(each: int = 4) -> list[Example]:
    """For every fault and mode of the benchmark some examples; f14 has none, no basic signal shows it."""
    rng = np.random.default_rng(SEEDS)
    made = [
        one
        for number, kind in FAULTS.items() if number != 14
        for mode in kind.modes
        for one in (_growing(kind, each, rng) if mode == "incipient" else _abrupt(kind, mode, each, rng))
    ]  # fmt: skip
    return [replace(one, seed=SEEDS + i) for i, one in enumerate(made)]


def _abrupt(kind: FaultKind, mode: str, each: int, rng: np.random.Generator) -> Iterator[Example]:
    """Strengths spread evenly around the one that is judged."""
    for share in _spread(each, rng):
        onset, strength = _onset(rng), LEVELS[mode] + _AROUND * (2 * share - 1)
        yield Example(kind.number, min(strength, 1.0), onset, 0.0, onset + _AFTER_S)


def _growing(kind: FaultKind, each: int, rng: np.random.Generator) -> Iterator[Example]:
    """To the full strength; of slow faults also what is seen of them in the first hour of a growth over days, and
    strengths held, evenly on a logarithmic scale: an alarm may come at any of them.
    """
    if kind.development_s <= _SLOW_S:
        for _ in range(each):
            onset = _onset(rng)
            yield Example(kind.number, 1.0, onset, kind.development_s, onset + kind.development_s + _AFTER_S)
        return
    for share in _spread(-(-each // 2), rng):
        onset, quick, days = _onset(rng), _between(_QUICK, share), _between(_DAYS, share)
        yield Example(kind.number, 1.0, onset, quick, onset + quick + _AFTER_S)
        yield Example(kind.number, 1.0, onset, days, onset + _FOLLOWED_S)
    for share in _spread(each, rng):
        onset = _onset(rng)
        yield Example(kind.number, _between(_HELD, share), onset, 0.0, onset + _FOLLOWED_S)


def _onset(rng: np.random.Generator) -> float:
    """600 to 700 s: at any phase of the set point."""
    return 600.0 + round(rng.uniform(0, 100))


def _spread(count: int, rng: np.random.Generator) -> list[float]:
    """One number in each of `count` equal parts of 0 to 1."""
    return [(part + float(rng.uniform())) / count for part in range(count)]


def _between(ends: tuple[float, float], share: float) -> float:
    """At a share of the way on a logarithmic scale."""
    return ends[0] * (ends[1] / ends[0]) ** share
