"""What a residual is like without a fault: centre, size, correlation, and limits with a declared margin.

No law of the tail is fitted: none carries a factor of ten beyond the record. What tomorrow may bring that the record
does not show has a margin instead, which shrinks as fault-free time grows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from detector.alarms.correlation import correlation_time
from detector.alarms.diagnostics import CHANGING, DRIFTS, findings
from detector.alarms.evidence import (
    BURST,
    FACTOR,
    IN_ROW,
    MEAN,
    N_BINS,
    N_RUNNING,
    N_SCALES,
    N_STATISTICS,
    PEAKED,
    SIZE,
    SIZE_WINSOR,
    STEP,
    WINSOR,
    ZONES,
    ResidualNumbers,
    advance,
)
from detector.alarms.promise import DAY_S
from recordings import Array, BadInput

LEAST_BLOCKS = 20
"""Independent blocks that a residual is learned from at least."""

_VILLE = 0.05
_RAISE, _MOST_RAISES = 1.15, 12
_RELATIVE = 1.25
"""Margin of a statistic that is relative to its block's own size."""

_DRIFTING = 1.5
"""How much wider the allowed bias is where the mean was seen to drift."""

_SPREAD = 4.0
"""A size may leave its median by so many times the way (as a ratio) from there to its 0.9 quantile."""

_GROSS, _SHARP = 1.5, 5.0
"""A gross residual is beyond so many margins, times the largest seen, for four correlation times or for two samples."""

_N_SCALES_TRIED = 8

_APART = 2.0
"""Correlation times from bet to bet on a sign: what is left of the correlation is less than the allowed bias."""

_MANY_TO_CORRELATE = 170
"""Fewer blocks do not tell a correlation of 0.15, the least that is counted, from none."""

_MANY = 1000
_LEAST_SHARE = 0.02
_LEAST_SIZE = 0.1
"""A residual that is quantised can rest for blocks; what is below a tenth of its size is nothing."""

_NORMAL_90 = 1.6448536269514722


def margin(seconds: float, memory_s: float = 0.0) -> float:
    """How far a residual may go beyond what so many fault-free seconds show: declared, not derived.

    memory_s [s] : of its size, where that is seen to change.

    >>> [round(margin(seconds), 1) for seconds in (80, 600, 3600, 86400)]
    [5.5, 4.3, 3.4, 2.3]
    """
    return max(2.3 * (DAY_S / seconds) ** (1.0 / 8.0), 1.6) * _rarely_seen(seconds, memory_s)


def allowed_bias(seconds: float, drifts: bool = False) -> float:
    """How far the mean may go, in sizes. drifts : whether it was seen to.

    >>> [round(allowed_bias(seconds), 2) for seconds in (80, 86400)]
    [0.39, 0.25]
    """
    return (_DRIFTING if drifts else 1.0) * 0.25 * math.sqrt(margin(seconds) / 2.3)


def size_margin(seconds: float) -> float:
    """The margin of a block's size that was not seen to change: narrow after a day, for so long a record shows it.

    >>> [round(size_margin(seconds), 1) for seconds in (80, 600, 3600, 86400)]
    [5.7, 4.1, 3.0, 1.8]
    """
    return max(1.8 * (DAY_S / seconds) ** 0.165, 1.5)


def _rarely_seen(seconds: float, memory_s: float) -> float:
    """Few ups and downs of a size with such a memory say little of what is to come."""
    return 1.0 + 10.0 * memory_s / seconds


def limits_of(quantiles: Array, n_blocks: Array, seconds: float, healthy: Healthy) -> Array:
    """Limits (n_scales, n_statistics) from the quantiles 0.5, 0.9, 0.999 of fault-free blocks, each of that shape."""
    middle, high, top = quantiles
    k = size_margin(seconds)
    if CHANGING in healthy.findings:
        k = max(k * _rarely_seen(seconds, healthy.memory_s), margin(seconds, healthy.memory_s))
    wide = np.maximum(k * high, middle * (high / np.maximum(middle, 1e-12)) ** _SPREAD)
    found = _RELATIVE * high
    found[:, MEAN] += allowed_bias(seconds, DRIFTS in healthy.findings) / healthy.usual
    found[:, [SIZE, BURST]] = wide[:, [SIZE, BURST]]
    found = np.maximum(found, _LEAST_SIZE)
    return healthy.raised * np.where(n_blocks >= _MANY, np.maximum(found, 1.15 * top), found)


def share_bound(bad: Array, n: Array) -> Array:
    """What the share of bad blocks is at most, with 95 % (above Clopper and Pearson's bound, and simpler).

    >>> share_bound(np.array([0.0, 10.0]), np.array([100.0, 100.0])).round(3).tolist()
    [0.03, 0.193]
    """
    return np.maximum((bad + 3.0 + 2.0 * np.sqrt(bad)) / np.maximum(n, 1.0), _LEAST_SHARE)


@dataclass(frozen=True, eq=False)
class Healthy:
    """A residual without a fault.

    centre, size : in its unit; block : samples of the shortest block; thin : samples from bet to bet; usual : median of
    the blocks' mean size; dead, fair : dead zone of the signs and their largest mean; gross, in_row : size that so many
    samples in a row do not have; sharp : size that two in a row do not have; dt_s, seconds : sampling time and length
    of the data [s]; raised : by how much the margins had to be raised; memory_s : of its size, where that changes [s];
    limits, shares, edges (n_scales, n_statistics) : of blocks, how often healthy ones are beyond them, and the lowest
    edges of histograms; a share of 1 where too few blocks were seen; findings : what the data show that is not as
    assumed.
    """

    centre: float
    size: float
    block: int
    thin: int
    usual: float
    dead: float
    fair: float
    far: float
    far_fair: float
    gross: float
    in_row: int
    sharp: float
    dt_s: float
    seconds: float
    raised: float
    memory_s: float
    limits: Array
    shares: Array
    edges: Array
    findings: tuple[str, ...]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Healthy) and self.as_dict() == other.as_dict()

    def __hash__(self) -> int:
        return hash((self.centre, self.size, self.seconds))

    @property
    def needed_s(self) -> float:
        """What has to be learned from until more than gross residuals are judged [s]."""
        return LEAST_BLOCKS * self.block * self.dt_s

    @property
    def only_gross(self) -> bool:
        """Whether the data were fewer than `LEAST_BLOCKS` independent blocks."""
        return self.seconds < self.needed_s

    def allowing(self, bias: float) -> Healthy:
        """The same where each valve may have an error that lasts, of so many sizes at most.

        At that bound every other sign of a healthy residual is beyond the zone. What is relative to a block's own size
        is not judged, for an error that lasts is most of it.
        """
        limits, shares = self.limits.copy(), self.shares.copy()
        limits[:, [SIZE, BURST]] += bias
        shares[:, [MEAN, PEAKED]] = 1.0
        return replace(
            self, dead=self.dead + bias, far=self.far + bias, fair=max(self.fair, 0.5),
            far_fair=max(self.far_fair, 0.5), gross=self.gross + bias, sharp=self.sharp + bias, limits=limits,
            shares=shares, edges=limits * STEP ** (1.0 - N_BINS),
        )  # fmt: skip

    def is_gross(self, residual: float) -> bool:
        """Whether a residual is beyond what no margin explains."""
        return abs(residual - self.centre) > self.gross * self.size

    def numbers(self, share: float) -> ResidualNumbers:
        """As the compiled step takes it. share : of the allowed rate."""
        return ResidualNumbers(
            self.centre, self.size, float(self.block), float(self.thin), self.usual, self.dead, self.fair, self.far,
            self.far_fair, self.gross, float(self.in_row), self.sharp, self.dt_s, share,
        )  # fmt: skip

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        arrays = {name: getattr(self, name).tolist() for name in ("limits", "shares", "edges")}
        return asdict(self) | arrays | {"findings": list(self.findings)}

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> Healthy:
        """What `as_dict` gave."""
        arrays = {name: np.array(parts[name], float) for name in ("limits", "shares", "edges")}
        return cls(**{**parts, **arrays, "findings": tuple(parts["findings"])})


def learn_residual(residual: Array, dt_s: float, name: str = "residual") -> Healthy:
    """What a residual (n_samples,), dt_s [s] apart, is like without a fault; missing values are passed over.

    The margins are raised until the record itself passes. With fewer than `LEAST_BLOCKS` independent blocks only gross
    residuals can be judged. Raises BadInput when it is too short even for that, does not move, or does not pass.
    """
    r = residual[np.isfinite(residual)]
    if len(r) < 10 * LEAST_BLOCKS:
        few = f"{len(r)} samples are too few"
        raise BadInput(name, few, f"learn from {10 * LEAST_BLOCKS} samples of moving data at least")
    low, high = np.quantile(r, (0.05, 0.95))
    centre = float(np.mean(np.clip(r, low, high)))
    size = max(float(np.quantile(np.abs(r - centre), 0.9)) / _NORMAL_90, _resolution(r) / math.sqrt(12.0))
    if not size > 0:
        raise BadInput(name, "it never changes", "learn while the valve moves")
    z = (r - centre) / size
    of_signs = correlation_time(np.clip(z, -WINSOR, WINSOR))
    tau = max(of_signs, correlation_time(np.minimum(np.abs(z), WINSOR)))
    block = max(10, math.ceil(4.0 * tau))
    seconds, short = len(r) * dt_s, min(block, len(r) // LEAST_BLOCKS)
    blocks = [_statistics(z, (short if j == 0 else block) * FACTOR**j) for j in range(N_SCALES)]
    usual = max(float(np.median(blocks[0][SIZE])), _LEAST_SIZE)
    for one in blocks:
        own = np.maximum(one[SIZE], usual)
        one[MEAN] /= own
        one[PEAKED] /= own
    thin, in_row = (1 if of_signs < 1.2 else math.ceil(times * of_signs) for times in (_APART, 4.0))
    said = findings(z, short)
    memory_s = _memory([one[SIZE] for one in blocks]) * short * dt_s if CHANGING in said else 0.0
    none = np.zeros((N_SCALES, N_STATISTICS))
    first = Healthy(
        centre, size, block, thin, usual, 0.0, 0.0, 0.0, 0.0, 0.0, max(in_row, IN_ROW), 0.0, dt_s, seconds, 1.0,
        memory_s, none, none, none, said,
    )  # fmt: skip
    for raises in range(_MOST_RAISES + 1):
        found = _with_margin(first, z, blocks, _RAISE**raises)
        if _passes(found, r):
            return found
    raise BadInput(name, "its healthy data come in spells", "learn for longer, over all that the valve usually does")


def _memory(sizes: list[Array]) -> float:
    """How long a size that changes remembers, in shortest blocks: by the scale that shows the most, for in short blocks
    noise hides a slow change. sizes : of the blocks of each scale, the first with `_MANY_TO_CORRELATE` or not.
    """
    found = 2.0 * correlation_time(np.log(sizes[0] + 1e-3))
    for j, one in enumerate(sizes[1:], 1):
        if len(one) >= _MANY_TO_CORRELATE:
            found = max(found, (2.0 * correlation_time(np.log(one + 1e-3)) - 1.0) * FACTOR**j)
    return found


def _largest_in_row(z: Array, n: int) -> float:
    """The largest size that n samples in a row had."""
    return float(sliding_window_view(np.abs(z), n)[:: max(n // 4, 1)].min(axis=1).max())


def _resolution(residual: Array) -> float:
    """The step in which a residual is quantised; next to nothing where it is not."""
    values = np.unique(residual)
    return float(np.diff(values).min()) if len(values) > 1 else 0.0


def _with_margin(first: Healthy, z: Array, blocks: list[Array], raised: float) -> Healthy:
    """Limits, bets and the gross size, with raised margins."""
    shape = (N_SCALES, N_STATISTICS)
    n = np.array([[one.shape[1]] * N_STATISTICS for one in blocks], float)
    quantiles = np.full((3, *shape), np.nan)
    for j, one in enumerate(blocks):
        if one.shape[1]:
            quantiles[:, j] = np.quantile(one, (0.5, 0.9, 0.999), axis=1)
    first = replace(first, raised=raised)
    limits = limits_of(quantiles, n, first.seconds, first)
    known = (n >= LEAST_BLOCKS) & (first.seconds >= first.needed_s)
    bad = np.array([np.sum(one > row[:, None], axis=1) for one, row in zip(blocks, limits, strict=True)], float)
    shares = np.where(known, share_bound(bad, n), 1.0)
    for j in range(1, N_SCALES):  # what was seen too rarely starts far out, to be learned in service
        limits[j] = np.where(known[j], limits[j], 2.0 * limits[j - 1])
    edges = limits * STEP ** (1.0 - N_BINS)
    bias = allowed_bias(first.seconds, DRIFTS in first.findings) * raised
    dead, far = (zone * bias for zone in ZONES)
    short = math.sqrt(max(first.needed_s / first.seconds, 1.0))  # of a residual that is not seen in all its states
    gross, sharp = (
        margins * short * raised * margin(first.seconds, first.memory_s) * max(_largest_in_row(z, n), 1.0)
        for margins, n in ((_GROSS, first.in_row), (_SHARP, IN_ROW))
    )
    fair = far_fair = 1.0
    if not first.only_gross:
        fair, far_fair = _fair(z[:: first.thin], dead), _far_fair(z[:: first.thin], far, bias, _resolution(z), first)
    return replace(
        first, dead=dead, fair=fair, far=far, far_fair=far_fair, gross=gross, sharp=sharp, limits=limits,
        shares=shares, edges=edges,
    )  # fmt: skip


def _fair(z: Array, dead: float) -> float:
    """The largest mean sign of a healthy residual: that of one whose centre is off by the dead zone."""
    n, inside = len(z), float(np.mean(np.abs(z) < 2.0 * dead))
    bound = min(inside + 1.645 * math.sqrt(inside * (1.0 - inside) / n) + 1.0 / n, 1.0)
    signs = np.sign(z) * (np.abs(z) > dead)
    spread = 1.645 * float(np.std(signs)) / math.sqrt(n)
    return min(0.5 * max(bound, math.erf(math.sqrt(2.0) * dead)) + abs(float(np.mean(signs))) + spread, 1.0)


def _far_fair(z: Array, far: float, bias: float, step: float, first: Healthy) -> float:
    """The same with the wide dead zone, whatever size within the margin the residual has: what a bias (and a half step,
    where it is quantised) can carry over the edge of the zone, and the mean sign that is there already.
    """
    n, over, most = len(z), bias + 0.5 * step, first.raised * margin(first.seconds, first.memory_s)
    means = list[float]()
    for scale in np.geomspace(1.0, most, _N_SCALES_TRIED):
        sizes = scale * np.abs(z)
        share = float(np.mean(np.abs(sizes - far) < over))
        signs = np.sign(z) * (sizes > far)
        unsure = math.sqrt((0.25 * share * (1.0 - share) + float(np.var(signs)) + 1.0 / n) / n)
        means.append(0.5 * share + abs(float(np.mean(signs))) + 1.645 * unsure)
    return min(max(means), 1.0)


def _passes(healthy: Healthy, residual: Array) -> bool:
    """Whether the evidence of the record against itself keeps to Ville's bound."""
    limit_s = healthy.seconds / _VILLE
    running, load = np.zeros(N_RUNNING), np.zeros(len(residual))
    counts = np.zeros((N_SCALES, N_STATISTICS, N_BINS + 1))
    shares = healthy.shares
    advance(running, healthy.limits, shares, counts, healthy.edges, healthy.numbers(1.0), limit_s, residual, load)
    return bool(load.max() < 1.0)


def _statistics(z: Array, length: int) -> Array:
    """Statistics (n_statistics, n_blocks) of blocks; MEAN and PEAKED not yet as shares of the block's own size."""
    n = len(z) // length
    blocks = z[: n * length].reshape(n, length)
    sizes = np.abs(blocks)
    burst = np.partition(sizes, -3, axis=1)[:, -3] if n else np.zeros(0)
    mean = np.abs(np.clip(blocks, -WINSOR, WINSOR).mean(axis=1))
    return np.array([mean, np.minimum(sizes, SIZE_WINSOR).mean(axis=1), burst, burst])
