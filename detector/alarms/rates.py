"""How often an alarm comes without a fault: from the scores of fault-free data, with an interval by block bootstrap.

A score is the alarm statistic of a detector; an alarm is a score above its limit. What is wanted lies far beyond what
was seen (one alarm a month, from an hour of data), so the largest scores of blocks are extrapolated with the
distribution of largest values (Gumbel, by moments). Its tail is that of a CUSUM and heavier than that of Gaussian or
bounded noise, so it errs on the safe side for those. Blocks are drawn with replacement (Künsch 1989; here they do not
overlap and are long against the correlation of the scores), which carries the scarcity of the data into the interval.
What a model does not know comes again with every stroke of the valve, so that blocks of one stroke are no independent
news: no more blocks are drawn than there were strokes (m out of n, Bickel, Götze and van Zwet 1997).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from recordings import Array, BadInput

MONTH_S = 30 * 86400.0
LEAST_BLOCKS = 20
"""With fewer blocks the bootstrap says nothing about the spread of the largest scores."""

LEAST_STROKES = 8
"""With fewer strokes too little of the valve's range was seen, whatever the number of samples."""

STROKE = 0.15
"""A stroke is a motion against the one before it by so much of the range."""

_DRAWS = 400
_CONFIDENCE = (0.025, 0.975)
_EULER = 0.5772156649015329
_CORRELATED = 0.2


@dataclass(frozen=True)
class FalseAlarms:
    """Expected false alarms a month at the chosen setting, with a 95 % interval.

    per_month, lower, upper : extrapolated; seen : scores above the limit in the data, runs of them counted once;
    seconds : of fault-free data; blocks : number of blocks they were cut into, of block_s [s] each.
    """

    per_month: float
    lower: float
    upper: float
    seen: int
    seconds: float
    blocks: int
    block_s: float

    @property
    def sentence(self) -> str:
        """In words."""
        rate, low, high = (f"{value:.2g}" for value in (self.per_month, self.lower, self.upper))
        basis = f"{self.seen} in {self.seconds:.0f} s of fault-free data, {self.blocks} blocks of {self.block_s:.1f} s"
        return f"false alarms: {rate} a month expected (95 % interval {low} to {high}); {basis}"

    def as_dict(self) -> dict[str, float]:
        """Plain numbers."""
        return asdict(self)

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> FalseAlarms:
        """What `as_dict` gave."""
        return cls(**parts)


@dataclass(frozen=True)
class Blocks:
    """The largest scores of blocks of equal length: largest (n_blocks,); block_s [s]; seconds : of data in all;
    strokes : of the valve meanwhile.
    """

    largest: Array
    block_s: float
    seconds: float
    strokes: int

    @classmethod
    def of(cls, score: Array, dt_s: float, strokes: int) -> Blocks:
        """Cut scores (n_samples,), dt_s [s] apart, into blocks long against their correlation.

        Raises BadInput when that leaves fewer than `LEAST_BLOCKS`, or there were fewer strokes than `LEAST_STROKES`.
        """
        if strokes < LEAST_STROKES:
            found = f"the valve moved to and fro {strokes} times only"
            remedy = f"learn while it moves over its usual range and back, {LEAST_STROKES} times at least"
            raise BadInput("false-alarm rate", found, remedy)
        n = max(10, 3 * _correlated(score))
        n_blocks = len(score) // n
        if n_blocks < LEAST_BLOCKS:
            found = f"{len(score)} samples in {len(score) * dt_s:.4g} s are {n_blocks} independent blocks"
            remedy = f"{LEAST_BLOCKS} are needed: learn from {LEAST_BLOCKS * n * dt_s:.0f} s of moving data at least"
            raise BadInput("false-alarm rate", found, remedy)
        largest = score[: n_blocks * n].reshape(n_blocks, n).max(axis=1)
        return cls(largest, n * dt_s, len(score) * dt_s, strokes)

    def limit(self, per_month: float, seed: int = 0) -> float:
        """The limit at which the upper end of the interval is `per_month` alarms a month."""
        share = min(per_month * self.block_s / MONTH_S, 0.5)
        beyond = -math.log(-math.log1p(-share))
        middle, spread = self._drawn(seed)
        return float(np.quantile(middle + spread * beyond, _CONFIDENCE[1]))

    def rate(self, limit: float = 1.0, seed: int = 0) -> FalseAlarms:
        """Alarms a month for a limit."""
        drawn = self._per_month(limit, *self._drawn(seed))
        best = self._per_month(limit, *_gumbel(self.largest[None, :]))
        lower, upper = np.quantile(drawn, _CONFIDENCE)
        over = self.largest > limit
        seen = int(np.sum(over & ~np.concatenate([[False], over[:-1]])))
        return FalseAlarms(
            float(best[0]), float(lower), float(upper), seen, self.seconds, len(self.largest), self.block_s
        )

    def _per_month(self, limit: float, middle: Array, spread: Array) -> Array:
        with np.errstate(over="ignore"):
            share = -np.expm1(-np.exp(-(limit - middle) / np.maximum(spread, 1e-12)))
        return share * MONTH_S / self.block_s

    def _drawn(self, seed: int) -> tuple[Array, Array]:
        rng = np.random.default_rng(seed)
        n = len(self.largest)
        return _gumbel(self.largest[rng.integers(0, n, (_DRAWS, min(n, self.strokes)))])


def _gumbel(largest: Array) -> tuple[Array, Array]:
    """Location and scale of each row, by moments."""
    spread = np.std(largest, axis=1, ddof=1) * math.sqrt(6.0) / math.pi
    return np.mean(largest, axis=1) - _EULER * spread, spread


def least_limit(dt_s: float, per_month: float) -> float:
    """The least limit of a CUSUM of log-likelihood ratios for a rate of false alarms.

    Without a change it takes exp(limit) samples on average at least (Lorden 1971), however few data were learned from.
    """
    return math.log(max(MONTH_S / (dt_s * per_month), math.e))


def strokes_of(x: Array) -> int:
    """How often a position (n_samples,) turns, motions below a share `STROKE` of its range not counted."""
    x = x[np.isfinite(x)]
    least = STROKE * float(np.quantile(x, 0.995) - np.quantile(x, 0.005)) if len(x) else 0.0
    if not least > 0:
        return 0
    turns, way, far = 0, 0, float(x[0])
    for value in x.tolist():
        if way * (value - far) >= 0 and way:
            far = value
        elif abs(value - far) >= least:
            turns, way, far = turns + (way != 0), 1 if value > far else -1, value
    return turns


def _correlated(score: Array) -> int:
    """Samples over which scores are correlated: the last lag with a correlation above 0.2, within a sixtieth."""
    most = max(len(score) // (3 * LEAST_BLOCKS), 1)
    about = score - np.mean(score)
    power = float(about @ about)
    if power <= 0:
        return 1
    size = 1 << (2 * len(about) - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(about, size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[: most + 1] / power
    high = np.flatnonzero(np.abs(correlation) > _CORRELATED)
    return min(int(high[-1]) + 1, most) if len(high) else 1
