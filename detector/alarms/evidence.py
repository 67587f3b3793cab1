"""Evidence that a residual is not what it was: multiplied up sample by sample, against a rate that is declared.

A block of samples is bad when one of its statistics is beyond its limit. Healthy blocks are bad with a probability of
at most p; the likelihood ratio of a larger share of bad blocks is then an e-value, with an expectation of at most one,
and R <- (R + 1) L is the e-detector of Shiryaev and Roberts (Shin, Ramdas and Rinaldo, "E-detectors", 2023): R less the
number of its steps is a supermartingale. So is any weighted mean of several, each counted in the seconds of its step,
and the mean time until it reaches a limit of so many seconds is that limit at least.

Beside the blocks the signs of single samples are bet on: R <- (R + 1)(1 + b (s - m0) / (1 + m0)), where b is the stake
and m0 the largest mean sign of a healthy residual. A sample within a dead zone has the sign 0. A wide zone hardly feels
a small bias, so that m0 is small and a large shift is soon seen; a narrow one sees the small shifts.
"""

from __future__ import annotations

from math import fabs
from typing import NamedTuple

import numpy as np

from detector.arithmetic.native import inlined, native

N_SCALES, FACTOR = 4, 4
"""Blocks are of one, four, sixteen and sixty-four times the shortest length."""

MEAN, SIZE, BURST, PEAKED = range(4)
N_STATISTICS = 4
"""Of a block: its mean and its third largest size, both as shares of its own size; its mean size and its third largest
size, as they are. PEAKED is the relative form of BURST.
"""

N_BINS, STEP = 24, 2.0 ** (1.0 / 6.0)
"""A histogram counts how often a statistic is beyond its lowest edge times STEP to the power of 0, 1, 2, ..."""

ALTERNATIVES = (0.4, 0.9)
"""Shares of bad blocks that are bet on."""

BETS = (0.3, 0.8, 0.98)
"""Stakes on the sign of single samples, as shares of what may be lost."""

ZONES = (1.5, 5.0)
"""Dead zones of the signs, in allowed biases."""

WINSOR, SIZE_WINSOR = 4.0, 8.0
_CLUSTER, _CLUSTER_SHARE = 60, 0.2
"""So many blocks after a bad one the next is bad with such a probability at most: one gust is not counted as many."""

IN_ROW = 2
"""One wild sample is no alarm."""

CAP = 2.0
"""Evidence counts up to so many limits, so that it can come down again."""

N_EACH = len(ALTERNATIVES)
N_SIGNS = 2 * len(BETS) * len(ZONES)
_BLOCK = 6
_R = _BLOCK * N_SCALES
_SINCE = _R + N_SCALES * N_STATISTICS * N_EACH
_SIGNS = _SINCE + N_SCALES * N_STATISTICS
_TICK = _SIGNS + N_SIGNS
_BEYOND = _TICK + 1
_SHARP = _TICK + 2
N_RUNNING = _TICK + 3
"""Places of what is remembered: blocks in the making; evidence of blocks; blocks since a bad one; evidence of signs;
samples since a bet, and how many in a row are gross and sharp.
"""

N_DETECTORS = N_SCALES * N_STATISTICS * N_EACH + N_SIGNS


class ResidualNumbers(NamedTuple):
    """A learned residual as the compiled step takes it, all floats: see `detector.alarms.healthy.Healthy`."""

    centre: float
    size: float
    block: float
    thin: float
    usual: float
    dead: float
    fair: float
    far: float
    far_fair: float
    gross: float
    in_row: float
    sharp: float
    dt_s: float
    share: float


@native
def advance(running, limits, shares, counts, edges, numbers, limit_s, residual, load):  # type: ignore[no-untyped-def]
    """Take samples into what is remembered, in place.

    running (N_RUNNING,); limits, shares (N_SCALES, N_STATISTICS) : of blocks, and how often healthy ones are beyond
    them; counts (N_SCALES, N_STATISTICS, N_BINS + 1) : histogram of this period, its last column the number of blocks;
    edges (N_SCALES, N_STATISTICS) : lowest edge of each; limit_s : evidence of an alarm [s]; residual, load (n,) :
    samples, and evidence after each as a share of the limit.
    Samples that are not finite are passed over.
    """
    signs, blocks = _sum_of_signs(running, numbers), _sum_of_blocks(running, numbers)
    for i in range(len(residual)):
        r = residual[i]
        if np.isfinite(r):
            z = (r - numbers.centre) / numbers.size
            running[_BEYOND] = running[_BEYOND] + 1.0 if fabs(z) > numbers.gross else 0.0
            running[_SHARP] = running[_SHARP] + 1.0 if fabs(z) > numbers.sharp else 0.0
            running[_TICK] += 1.0
            if running[_TICK] >= numbers.thin:
                running[_TICK] = 0.0
                _bet(running, z, numbers, limit_s)
                signs = _sum_of_signs(running, numbers)
            _add(running, z)
            if running[0] >= numbers.block:
                _close(running, limits, shares, counts, edges, numbers, limit_s)
                blocks = _sum_of_blocks(running, numbers)
        evidence = numbers.share * (signs + blocks) / limit_s
        gross = running[_BEYOND] >= numbers.in_row or running[_SHARP] >= IN_ROW
        load[i] = max(evidence, CAP) if gross else evidence


@native
def advance_all(running, limits, shares, counts, edges, numbers, limit_s, residuals, load):  # type: ignore[no-untyped-def]
    """`advance` of several residuals in one call, for a call costs more than a sample: all arguments have one dimension
    more in front, n_channels; numbers (n_channels, n_numbers) : a row of `ResidualNumbers` each.
    """
    for i in range(running.shape[0]):
        n = numbers[i]
        one = ResidualNumbers(
            n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8], n[9], n[10], n[11], n[12], n[13]
        )  # fmt: skip
        advance(running[i], limits[i], shares[i], counts[i], edges[i], one, limit_s, residuals[i], load[i])


@native
def closes(running, numbers, n):  # type: ignore[no-untyped-def]
    """Whether a block may end within n more samples, so that histograms change; arguments as in `advance_all`."""
    ends = False
    for i in range(running.shape[0]):
        ends = ends or running[i, 0] + n >= numbers[i, 2]
    return ends


@inlined
def _bet(running, z, numbers, limit_s):  # type: ignore[no-untyped-def]
    """Bets on the sign of a sample, up and down, with a narrow and with a wide dead zone."""
    cap = CAP * limit_s * N_DETECTORS / (numbers.thin * numbers.dt_s * numbers.share)
    _bet_beyond(running, z, _SIGNS, numbers.dead, numbers.fair, cap)
    _bet_beyond(running, z, _SIGNS + 2 * len(BETS), numbers.far, numbers.far_fair, cap)


@inlined
def _bet_beyond(running, z, first, dead, fair, cap):  # type: ignore[no-untyped-def]
    s = 0.0
    if z > dead:
        s = 1.0
    elif z < -dead:
        s = -1.0
    for k in range(len(BETS)):
        stake = BETS[k] / (1.0 + fair)
        up, down = first + 2 * k, first + 2 * k + 1
        running[up] = min((running[up] + 1.0) * (1.0 + stake * (s - fair)), cap)
        running[down] = min((running[down] + 1.0) * (1.0 + stake * (-s - fair)), cap)


@inlined
def _sum_of_signs(running, numbers):  # type: ignore[no-untyped-def]
    total = 0.0
    for k in range(N_SIGNS):
        total += running[_SIGNS + k]
    return total * numbers.thin * numbers.dt_s / N_DETECTORS


@inlined
def _sum_of_blocks(running, numbers):  # type: ignore[no-untyped-def]
    total, seconds, each = 0.0, numbers.block * numbers.dt_s, N_STATISTICS * N_EACH
    for j in range(N_SCALES):
        for k in range(each):
            total += seconds * running[_R + j * each + k]
        seconds *= FACTOR
    return total / N_DETECTORS


@inlined
def _add(running, z):  # type: ignore[no-untyped-def]
    """A sample into the shortest block: number, sum, sum of sizes, three largest sizes."""
    size = fabs(z)
    running[0] += 1.0
    running[1] += min(max(z, -WINSOR), WINSOR)
    running[2] += min(size, SIZE_WINSOR)
    _largest(running, 3, size)


@inlined
def _largest(running, place, size):  # type: ignore[no-untyped-def]
    """The three largest so far."""
    if size > running[place]:
        running[place + 2], running[place + 1], running[place] = running[place + 1], running[place], size
    elif size > running[place + 1]:
        running[place + 2], running[place + 1] = running[place + 1], size
    elif size > running[place + 2]:
        running[place + 2] = size


@native
def _close(running, limits, shares, counts, edges, numbers, limit_s):  # type: ignore[no-untyped-def]
    """The end of a block, and of the longer ones that end with it."""
    long = numbers.block
    for j in range(N_SCALES):
        at = _BLOCK * j
        mean, size, burst = running[at + 1] / long, running[at + 2] / long, running[at + 5]
        own = max(size, numbers.usual)
        _judge(running, j, MEAN, fabs(mean) / own, limits, shares, counts, edges, numbers, limit_s)
        _judge(running, j, SIZE, size, limits, shares, counts, edges, numbers, limit_s)
        _judge(running, j, BURST, burst, limits, shares, counts, edges, numbers, limit_s)
        _judge(running, j, PEAKED, burst / own, limits, shares, counts, edges, numbers, limit_s)
        if j + 1 < N_SCALES:
            above = at + _BLOCK
            running[above] += running[at]
            running[above + 1] += running[at + 1]
            running[above + 2] += running[at + 2]
            for k in range(3):
                _largest(running, above + 3, running[at + 3 + k])
        for k in range(_BLOCK):
            running[at + k] = 0.0
        long *= FACTOR
        if j + 1 < N_SCALES and running[_BLOCK * (j + 1)] < long - 0.5:
            break


@native
def _judge(running, j, k, value, limits, shares, counts, edges, numbers, limit_s):  # type: ignore[no-untyped-def]
    """One statistic of one block: counted, and taken as evidence."""
    limit, place = limits[j, k], j * N_STATISTICS + k
    edge = edges[j, k]
    counts[j, k, N_BINS] += 1.0
    for b in range(N_BINS):
        if value <= edge:
            break
        counts[j, k, b] += 1.0
        edge *= STEP
    bad, share = value > limit, shares[j, k]
    if running[_SINCE + place] > 0.0:
        share = max(share, _CLUSTER_SHARE)
        running[_SINCE + place] -= 1.0
    seconds = numbers.block * numbers.dt_s * FACTOR**j
    cap = CAP * limit_s * N_DETECTORS / (seconds * numbers.share)
    for e in range(N_EACH):
        at, wanted = _R + place * N_EACH + e, ALTERNATIVES[e]
        if share >= wanted:
            running[at] = 0.0
            continue
        ratio = wanted / share if bad else (1.0 - wanted) / (1.0 - share)
        running[at] = min((running[at] + 1.0) * ratio, cap)
    if bad:
        running[_SINCE + place] = _CLUSTER
