"""From any detector's channels to alarms at a stated rate of false ones: the same for every detector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recordings import Array, BadInput

BLOCK_S = 600
"""Largest values are taken over blocks of this length [s]."""

HOLD_S = 60
"""An alarm stays for this long [s] after the last exceedance."""

_EULER = 0.5772156649
_LEAST_BLOCKS = 15


@dataclass(frozen=True, eq=False)
class Levels:
    """levels (n_channels,) : what each channel may reach; threshold : what the largest share of a level may reach."""

    levels: Array
    threshold: float

    def statistic(self, channels: Array) -> Array:
        """One number (n,) of channels (n, n_channels): an alarm above 1. Values that are missing count as none."""
        return np.nan_to_num(np.abs(channels) / self.levels).max(axis=1) / self.threshold


def calibrate(blocks: Array, rate_per_h: float, block_s: int = BLOCK_S, starts: Sequence[Array] = ()) -> Levels:
    """Levels for a rate of false alarms, from the largest values in blocks (n_blocks, n_channels) of fault-free runs.

    Every channel gets an equal share of the rate; then the threshold on the largest share of a level is set for the
    whole rate. Both by the Gumbel distribution of largest values, and never below what was seen. Blocks that follow a
    start, each (n_starts, n_channels) of a kind of start and a time after it, are distributions of their own, however
    rare they are among the others: the rate holds in all, and the highest level counts.
    Raises BadInput for less than 15 blocks.
    """
    if len(blocks) < _LEAST_BLOCKS:
        found = f"{len(blocks)} blocks of {block_s} s"
        raise BadInput(
            "fault-free runs", found, f"give {_LEAST_BLOCKS}, {_LEAST_BLOCKS * block_s / 3600:.1f} h, at least"
        )
    kinds = [blocks, *starts]
    each = [_gumbel(kind, rate_per_h / blocks.shape[1], block_s) for kind in kinds]
    levels = np.maximum(np.max(each, axis=0), 1e-12)
    shares = [_gumbel((kind / levels).max(axis=1, keepdims=True), rate_per_h, block_s)[0] for kind in kinds]
    return Levels(levels, float(max(shares)))


def alarms(statistic: Array, hold_s: int = HOLD_S) -> NDArray[np.bool_]:
    """Whether there is an alarm (n,): above 1 now or within the last `hold_s` rows.

    >>> alarms(np.array([0.0, 2.0, 0.0, 0.0, 0.0]), hold_s=2).tolist()
    [False, True, True, True, False]
    """
    rows = np.arange(len(statistic))
    last = np.maximum.accumulate(np.where(statistic > 1, rows, -hold_s - 1))
    return rows - last <= hold_s


def raised(alarm: NDArray[np.bool_], settle: int = 0) -> int:
    """How many alarms begin in a run, from row `settle` on; one that stands there counts."""
    after = alarm[settle:]
    return int(np.sum(after & ~np.concatenate([[False], after[:-1]])))


def largest(channels: Array, settle_s: int, block_s: int = BLOCK_S) -> Array:
    """Largest sizes of channels (n, n_channels), one row a second, in blocks from `settle_s` on."""
    settled = np.nan_to_num(np.abs(channels[settle_s:]))
    whole = len(settled) // block_s * block_s
    return settled[:whole].reshape(-1, block_s, settled.shape[1]).max(axis=1)


def _gumbel(blocks: Array, rate_per_h: float, block_s: int) -> Array:
    """The value exceeded `rate_per_h` times an hour, by moments; at least the largest seen."""
    scale = blocks.std(axis=0) * np.sqrt(6) / np.pi
    place = blocks.mean(axis=0) - _EULER * scale
    return np.maximum(place + scale * np.log(3600 / block_s / rate_per_h), blocks.max(axis=0))
