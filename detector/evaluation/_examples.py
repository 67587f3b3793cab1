"""Faults simulated to learn signatures from: other seeds, strengths, onsets and growth than are judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.evaluation._plant import Array, Setting, with_fault
from simulator.damadics import FAULTS, LEVELS, Form

SEEDS = 50_000
"""Seeds of examples begin here; judged runs stay below."""

_AFTER_S = 600
_GROWTH_S = (3600.0, 3600.0, 7200.0)


@dataclass(frozen=True)
class Example:
    """One fault to simulate. number : 1 to 19; strength : final; onset_s, grows_s, duration_s [s]."""

    number: int
    strength: float
    onset_s: float
    grows_s: float
    duration_s: float
    seed: int

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


def examples(each: int = 3) -> list[Example]:
    """For every fault and mode of the benchmark some examples; f14 has none, no basic signal shows it."""
    rng, made = np.random.default_rng(SEEDS), list[Example]()
    for number, kind in FAULTS.items():
        for mode in kind.modes if number != 14 else ():
            for i in range(each):
                onset, seed = 600.0 + round(rng.uniform(0, 100)), SEEDS + len(made)
                if mode == "incipient":
                    grows = _GROWTH_S[i % len(_GROWTH_S)] if kind.development_s > 3600 else kind.development_s
                    made.append(Example(number, 1.0, onset, grows, onset + grows + _AFTER_S, seed))
                else:
                    strength = float(np.clip(LEVELS[mode] + rng.uniform(-0.06, 0.06), 0.05, 1.0))
                    made.append(Example(number, strength, onset, 0.0, onset + _AFTER_S, seed))
    return made
