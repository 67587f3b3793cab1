"""Masing's rules as a loop compiled by numba: a virgin curve, its doubled branches, and the stacks of extrema."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np

native: Callable[[Any], Any] = numba.njit(cache=True, error_model="numpy", nogil=True)


@native
def curve(x, knots, values):  # type: ignore[no-untyped-def]
    """A point-symmetrical curve (n_knots) from its half for x >= 0: linear between its knots, level beyond the last."""
    size = abs(x)
    if size >= knots[-1]:
        return values[-1] if x > 0 else -values[-1]
    i = min(max(np.searchsorted(knots, size) - 1, 0), len(knots) - 2)
    y = values[i] + (values[i + 1] - values[i]) * (size - knots[i]) / (knots[i + 1] - knots[i])
    return y if x > 0 else -y


@native
def closed(x, way, origin, turns, n):  # type: ignore[no-untyped-def]
    """How many of n turns (n_turns, 2) are left when x moves one way [-1 or 1]: closing an inner loop takes both of its
    extrema, and beyond the mirror of the first turn the virgin curve goes on.
    """
    while n:
        target = turns[n - 2, 0] if n > 1 else 2 * origin - turns[0, 0]
        if (x - target) * way < 0:
            break
        n -= 2 if n > 1 else 1
    return n


@native
def force(x, origin, turns, n, knots, values):  # type: ignore[no-untyped-def]
    """The force at x on the virgin curve, or on the branch from the last turn: F_b + 2 V((x - x_b)/2)."""
    if n == 0:
        return curve(x - origin, knots, values)
    return turns[n - 1, 1] + 2 * curve((x - turns[n - 1, 0]) / 2, knots, values)


@native
def follow(path, out, state, turns, knots, values):  # type: ignore[no-untyped-def]
    """Fill out (n_samples) along a path (n_samples). state : x, way, force, origin; returns the number of turns.

    Where the virgin curve has become level it drags its origin along: sliding forgets all turns.
    """
    x, way, now, origin, n = state[0], state[1], state[2], state[3], int(state[4])
    for k in range(len(path)):
        moved = path[k] - x
        if moved != 0:
            if way * moved < 0:
                turns[n, 0], turns[n, 1] = x, now
                n += 1
            way = 1.0 if moved > 0 else -1.0
            x = path[k]
            n = closed(x, way, origin, turns, n)
            if n == 0 and abs(x - origin) > knots[-1]:
                origin = x - way * knots[-1]
            now = force(x, origin, turns, n, knots, values)
        out[k] = now
    state[0], state[1], state[2], state[3], state[4] = x, way, now, origin, n


@native
def slipping(now, way, level, n, turns, count):  # type: ignore[no-untyped-def]
    """dz/dx of (2.34) at a force, r being F/S on the virgin curve and (F - F_b)/(2 S) on a branch."""
    r = way * now / level if count == 0 else way * (now - turns[count - 1, 1]) / (2 * level)
    share = abs(r) if n == 1.0 else abs(r) ** n
    return 1 - share if r >= 0 else 1 + share


@native
def creep(moves, levels, n, step, forces, slips, state, turns, knots, values):  # type: ignore[no-untyped-def]
    """Fill forces and slips (n_moves) for moves of x at levels S (n_moves): (2.34) by the midpoint rule."""
    z, way, now, origin, count = state[0], state[1], state[2], state[3], int(state[4])
    for k in range(len(moves)):
        before = z
        if moves[k] != 0:
            if way * moves[k] < 0:
                turns[count, 0], turns[count, 1] = z, now
                count += 1
            way = 1.0 if moves[k] > 0 else -1.0
            parts = int(np.ceil(abs(moves[k]) / step))
            h, level = moves[k] / parts, levels[k]
            for _ in range(parts):
                half = z + h / 2 * slipping(now, way, level, n, turns, count)
                middle = force(half, origin, turns, count, knots, values)
                moved = h * slipping(middle, way, level, n, turns, count)
                z += moved
                if moved * way > 0:
                    count = closed(z, way, origin, turns, count)
                now = force(z, origin, turns, count, knots, values)
                if count and now * way >= level:  # sliding resets the stacks
                    origin, count = z - way * np.interp(abs(now), values, knots), 0
        forces[k], slips[k] = now, z - before
    state[0], state[1], state[2], state[3], state[4] = z, way, now, origin, count


@native
def slips(moves, stiffness, levels, forces, out):  # type: ignore[no-untyped-def]
    """Fill out (n_moves) with the sum of forces (n_elements), changed in place: springs that slip at their levels."""
    for k in range(len(moves)):
        total = 0.0
        for i in range(len(forces)):
            forces[i] = min(max(forces[i] + stiffness[i] * moves[k], -levels[i]), levels[i])
            total += forces[i]
        out[k] = total
