"""The sums (2.57) and (2.58) as a loop compiled by numba: what complete links add is kept beside each minimum."""

from __future__ import annotations

import numpy as np

from simulator.hysteresis.masing import native


@native
def everett(alpha, beta, levels, values):  # type: ignore[no-untyped-def]
    """F between levels (n): bilinear in a whole cell, linear in the triangle that the line alpha = beta cuts off."""
    last = len(levels) - 1
    alpha, beta = min(max(alpha, levels[0]), levels[last]), min(max(beta, levels[0]), levels[last])
    if alpha <= beta:
        return 0.0
    i = min(max(np.searchsorted(levels, alpha) - 1, 0), last - 1)
    j = min(max(np.searchsorted(levels, beta, side="right") - 1, 0), last - 1)
    a = (alpha - levels[i]) / (levels[i + 1] - levels[i])
    b = (beta - levels[j]) / (levels[j + 1] - levels[j])
    if i == j:
        return values[i + 1, i] * (a - b)
    low = values[i, j] + (values[i + 1, j] - values[i, j]) * a
    high = values[i, j + 1] + (values[i + 1, j + 1] - values[i, j + 1]) * a
    return low + (high - low) * b


@native
def follow(path, out, now, turns, sums, n, levels, values):  # type: ignore[no-untyped-def]
    """Fill out (n_samples) along a path (n_samples); returns how many turns there are.

    turns : m_0, M_1, m_1, ...; sums : beside a minimum, output when the input was there; now : the last input.
    """
    low, high = levels[0], levels[-1]
    for k in range(len(path)):
        u = min(max(path[k], low), high)
        if u > now:
            if n % 2 == 0:
                add_minimum(now, turns, sums, n, levels, values)
                n += 1
            while n > 1 and u >= turns[n - 2]:
                n -= 2
        elif u < now:
            if n % 2 == 1:
                turns[n] = now
                n += 1
            while n > 2 and u <= turns[n - 2]:
                n -= 2
        now = u
        if n % 2 == 1:
            out[k] = sums[n - 1] + 2 * everett(u, turns[n - 1], levels, values)
        else:
            top, before = turns[n - 1], turns[n - 2]
            link = everett(top, before, levels, values) - everett(top, u, levels, values)
            out[k] = sums[n - 2] + 2 * link
    return n


@native
def add_minimum(u, turns, sums, n, levels, values):  # type: ignore[no-untyped-def]
    """The input turned at a minimum u: its link is complete."""
    top, before = turns[n - 1], turns[n - 2]
    turns[n] = u
    sums[n] = sums[n - 2] + 2 * (everett(top, before, levels, values) - everett(top, u, levels, values))
