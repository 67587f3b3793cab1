"""Whether the stated rate of false alarms holds, for healthy residuals of many kinds, and what its price in delay is.

python -m benchmarks.false_alarms                              every family and window, seeds of development
python -m benchmarks.false_alarms --seed 9000 --trials 20 --days 20     as reported
python -m benchmarks.false_alarms --family gusts --window 600 --days 5  one cell
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import machine
from benchmarks.residual_families import DAY_S, DT_S, FAMILIES, Draw
from detector import Evidence, learn_evidence
from recordings import Array, BadInput

DEVELOPMENT_SEED = 1
"""Seeds 1 to 99 were looked at while the scheme was made; reported figures have others."""

WINDOWS_S = (80.0, 600.0, 3600.0, 86400.0)
WISH_S = 30 * DAY_S
HOLD_S = 30.0
SEEN_WITHIN_S = 3600.0
_PIECE = 432_000


Change = Callable[[Array, float], Array]
"""What a fault makes of a residual (n_samples,) of some size."""


def shifted(sizes: float) -> Change:
    """A lasting shift."""
    return lambda r, size: r + sizes * size


def grown(factor: float) -> Change:
    """A lasting change of size."""
    return lambda r, _: r * factor


def at_reversals(r: Array, size: float) -> Array:
    """A burst of ten sizes for half a second at every reversal, one in ten seconds."""
    when = np.arange(len(r)) % 200
    return r + 10.0 * size * ((when < 5).astype(float) - ((when >= 100) & (when < 105)))


CHANGES: dict[str, Change] = {
    "0.5": shifted(0.5), "1": shifted(1.0), "3": shifted(3.0), "x2": grown(2.0), "x4": grown(4.0),
    "bursts": at_reversals,
}  # fmt: skip


@dataclass
class Cell:
    """What came of the trials of a family and a window. gross : trials that judge gross residuals only; above :
    trials with more alarms than promised; any : with an alarm; delays [s], infinite where it was not seen.
    """

    trials: int = 0
    refused: int = 0
    gross: int = 0
    above: int = 0
    any: int = 0
    delays: dict[str, list[float]] = field(default_factory=lambda: {name: [] for name in CHANGES})

    @property
    def row(self) -> str:
        """As a row of a table."""
        asked = max(self.trials - self.refused, 1)
        delays = " / ".join(_seconds(self.delays[name]) for name in CHANGES)
        shares = f"{100 * self.above / asked:.0f} | {100 * self.any / asked:.0f}"
        return f"{self.refused} + {self.gross} of {self.trials} | {shares} | {delays}"


def _seconds(delays: Sequence[float]) -> str:
    middle = float(np.median(delays)) if delays else math.inf
    return f"{middle:.3g}" if math.isfinite(middle) else "none"


def trial(cell: Cell, draw: Draw, window_s: float, days: float) -> None:
    """Learn, and see delays, and false alarms while learning goes on."""
    cell.trials += 1
    try:
        evidence = learn_evidence({"residual": draw(round(window_s / DT_S))}, DT_S, WISH_S)
    except BadInput:
        cell.refused += 1
        return
    cell.gross += evidence.healthy[0].only_gross
    for name, change in CHANGES.items():
        cell.delays[name].append(delay(evidence, draw, change))
    found, allowed = counted(evidence, draw, days)
    cell.above += found > allowed
    cell.any += found > 0


def delay(evidence: Evidence, draw: Draw, change: Change) -> float:
    """Seconds from a change to the alarm, after five healthy minutes."""
    before = draw(3000)
    state, _ = evidence.run(evidence.initial(), before[:, None])
    changed = change(draw(round(SEEN_WITHIN_S / DT_S)), evidence.healthy[0].size)
    over = np.flatnonzero(evidence.run(state, changed[:, None])[1].sum(axis=1) >= 1.0)
    return (int(over[0]) + 1) * DT_S if len(over) else math.inf


def counted(evidence: Evidence, draw: Draw, days: float) -> tuple[int, float]:
    """Alarms in so many healthy days, and how many were promised at most."""
    state, found, allowed = evidence.initial(), 0, 0.0
    for _ in range(max(round(days * DAY_S / DT_S / _PIECE), 1)):
        state, load = evidence.run(state, draw(_PIECE)[:, None])
        found += alarms_of(load[:, 0] >= 1.0)
        allowed += _PIECE * DT_S / evidence.supported(state).interval_s
    return found, allowed


def alarms_of(over: NDArray[np.bool_]) -> int:
    """How many alarms begin in a run: above the limit after half a minute below it."""
    rows = np.flatnonzero(over)
    return int(np.sum(np.diff(rows) > HOLD_S / DT_S)) + 1 if len(rows) else 0


def main() -> None:
    """Print a row for every family and window."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--trials", type=int, default=5, help="in each cell")
    parser.add_argument("--days", type=float, default=5.0, help="in service, simulated, of each trial")
    parser.add_argument("--seed", type=int, default=DEVELOPMENT_SEED, help="of the first trial")
    parser.add_argument("--family", choices=FAMILIES, action="append")
    parser.add_argument("--window", type=float, choices=WINDOWS_S, action="append", help="learned time [s]")
    chosen = parser.parse_args()
    print(machine("numpy", "numba"))
    print("family | learned [s] | refused + gross only | % above | % any alarm | delays [s]")
    print(f"delays after {', '.join(CHANGES)}")
    for name in chosen.family or FAMILIES:
        for window_s in chosen.window or WINDOWS_S:
            cell = Cell()
            for seed in range(chosen.seed, chosen.seed + chosen.trials):
                trial(cell, FAMILIES[name](np.random.default_rng(seed)), window_s, chosen.days)
            print(f"{name} | {window_s:.0f} | {cell.row}", flush=True)


if __name__ == "__main__":
    main()
