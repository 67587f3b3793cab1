"""The loop of `sub_step.c` and `loop.c` for machines without a C compiler: the same in Python, compiled by numba.

`numba_loop.py` writes this text, from the line "The loop" on, behind the translated functions of one recurrence into a
module of their own, because numba keeps compiled code only of functions that call each other by name. What stands
above that line is the simplest recurrence there is, a state that stays as it is, and shows what the functions are.

Vectors: s states, e exo, p parameters; matrices of derivatives arrive flat and column-major, as CasADi gives them;
S, T and Y have a column per parameter and per initial state.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from recordings import Array
from simulator.compile.recurrence import MOTION

SCALE = 1e-5
"""A small value of the implicit scalar."""
GAMMA, AHEAD = 0.0, np.empty(0)
"""Share of a sub-step that a stage takes, and how far (n_states,) the second one starts beyond the first, in units of
what that moved; empty where the functions make a whole sub-step."""


def native(function: Callable[..., Any]) -> Any:
    """Compiles a function; here it leaves it to Python."""
    return function


def guess(s: Array, e: Array, p: Array) -> float:
    """Where the search for the implicit scalar starts."""
    return 0.0


def residual(w: float, s: Array, e: Array, p: Array) -> tuple[float, float]:
    """What has to vanish by the choice of w, and its slope."""
    return w, 1.0


def step(w: float, s: Array, e: Array, p: Array, new: Array) -> None:
    """The next state."""
    new[:] = s


def step_jac(w: float, s: Array, e: Array, p: Array, new: Array, A: Array, B: Array) -> None:
    """The next state and its derivatives by the state and the parameters."""
    new[:], A[:], B[:] = s, np.eye(len(s)).ravel(), 0.0


def output(s: Array, e: Array, p: Array, y: Array) -> None:
    """What is measured at a sample."""
    y[:] = s[: len(y)]


def output_jac(s: Array, e: Array, p: Array, y: Array, C: Array, D: Array) -> None:
    """What is measured at a sample and its derivatives by the state and the parameters."""
    y[:], C[:], D[:] = s[: len(y)], np.eye(len(y), len(s)).ravel(order="F"), 0.0


# The loop


@native
def solve(s: Array, e: Array, p: Array) -> float:
    """Newton inside a bracket that the signs of the residual tighten; NaN when there is no root to be found.

    The residual rises through its root. After 40 rounds only halving is left, and that always ends.
    """
    w = guess(s, e, p)
    low, high, reach = -math.inf, math.inf, SCALE
    for i in range(120):
        value, slope = residual(w, s, e, p)
        if not math.isfinite(value):
            return math.nan
        if value > 0:
            high = w
        else:
            low = w
        after = w - value / slope
        close = 1e-10 * (abs(w) + SCALE)
        if slope > 0 and abs(after - w) <= close:
            return after
        if high - low <= close:
            return w
        if not (slope > 0 and low < after < high) or i > 40:
            if math.isinf(low):
                after = w - reach
                reach *= 4
            elif math.isinf(high):
                after = w + reach
                reach *= 4
            else:
                after = 0.5 * (low + high)
        w = after
    return math.nan


@native
def chain(A: Array, B: Array, S: Array, result: Array) -> bool:
    """result = A S + [B 0]; whether all of it is finite."""
    rows, states, columns = result.shape[0], S.shape[0], S.shape[1]
    fine = True
    for i in range(rows):
        for c in range(columns):
            result[i, c] = B[i + rows * c] if c < columns - states else 0.0
        for j in range(states):
            a = A[i + rows * j]
            if a != 0.0:
                for c in range(columns):
                    result[i, c] += a * S[j, c]
        for c in range(columns):
            fine = fine and math.isfinite(result[i, c])
    return fine


@native
def finite(values: Array) -> bool:
    """Whether every entry is finite."""
    fine = True
    for i in range(values.shape[0]):
        fine = fine and math.isfinite(values[i])
    return fine


@native
def replace(new: Array, s: Array, S: Array) -> None:
    """States that are set back after a sample; NaN leaves a state as it is. Position and velocity forget what they
    depended on. Memory is moved along with them, and depends on the parameters as before.
    """
    for i in range(s.shape[0]):
        if not math.isnan(new[i]):
            s[i] = new[i]
            for c in range(S.shape[1] if i < MOTION else 0):
                S[i, c] = 0.0


@native
def fill(e: Array, u: Array, k: int, then: int, part: float, end: float) -> None:
    """The inputs of exo: at a part of the way from sample k to `then`, and at its end where there is room for them."""
    inputs = u.shape[1]
    for i in range(e.shape[0] - 2):
        way, column = (part, i) if i < inputs else (end, i - inputs)
        e[2 + i] = u[k, column] + way * (u[then, column] - u[k, column])


@native
def advance(e: Array, p: Array, s: Array, S: Array, T: Array, new: Array, A: Array, B: Array) -> bool:
    """One sub-step of the state, and of its derivatives where T has room for them; whether there was a root."""
    w = solve(s, e, p)
    if not math.isfinite(w):
        return False
    if T.shape[0]:
        step_jac(w, s, e, p, new, A, B)
        chain(A, B, S, T)
        for i in range(T.shape[0]):
            for c in range(T.shape[1]):
                S[i, c] = T[i, c]
    else:
        step(w, s, e, p, new)
    for i in range(s.shape[0]):
        s[i] = new[i]
    return True


@native
def sub_step(
    j: int, steps: int, t: Array, u: Array, k: int, then: int, to: int, p: Array, s: Array, S: Array, T: Array,
    new: Array, A: Array, B: Array, e: Array,
) -> bool:  # fmt: skip
    """Sub-step j of so many from sample k to `then`, with the inputs going to those of sample `to`."""
    dt = t[then] - t[k]
    if AHEAD.shape[0]:
        s0, S0 = s.copy(), S.copy()
        e[0], e[1] = t[k] + (j + GAMMA) / steps * dt, GAMMA * dt / steps
        fill(e, u, k, to, (j + GAMMA) / steps, (j + GAMMA) / steps)
        if not advance(e, p, s, S, T, new, A, B):
            return False
        for i in range(s.shape[0]):
            s[i] = s0[i] + AHEAD[i] * (s[i] - s0[i])
            for c in range(T.shape[1] if T.shape[0] else 0):
                S[i, c] = S0[i, c] + AHEAD[i] * (S[i, c] - S0[i, c])
        e[0] = t[k] + (j + 1.0) / steps * dt
        fill(e, u, k, to, (j + 1.0) / steps, (j + 1.0) / steps)
    else:
        e[0], e[1] = t[k] + (j + 0.5) / steps * dt, dt / steps
        fill(e, u, k, to, (j + 0.5) / steps, (j + 1.0) / steps)
    return bool(advance(e, p, s, S, T, new, A, B))


@native
def loop(
    t: Array, u: Array, hold: bool, h_max: float, p: Array, s: Array, y: Array, S: Array, Y: Array,
    resets: Array, e: Array,
) -> int:  # fmt: skip
    """As `scan` of `loop.c`; Y and resets have no rows where they are not wanted, e is room for exo."""
    n, ns, ny, sensitive = t.shape[0], s.shape[0], y.shape[1], Y.shape[0] > 0
    T = np.empty((ns if sensitive else 0, S.shape[1]))
    new, A, B = np.empty(ns), np.empty(ns * ns), np.empty(ns * p.shape[0])
    C, D = np.empty(ny * ns), np.empty(ny * p.shape[0])
    for k in range(n):
        then = k if k + 1 == n else k + 1
        e[0], e[1] = t[k], 0.0
        fill(e, u, k, k, 0.0, 0.0)
        if sensitive:
            output_jac(s, e, p, y[k], C, D)
        else:
            output(s, e, p, y[k])
        if not (finite(s) and finite(y[k])) or (sensitive and not chain(C, D, S, Y[k])):
            return k
        if resets.shape[0]:
            replace(resets[k], s, S)
        dt = t[then] - t[k]
        steps = math.ceil(dt / h_max - 1e-9) if 0.0 < h_max < dt else 1
        for j in range(steps if dt > 0.0 else 0):
            if not sub_step(j, steps, t, u, k, then, k if hold else then, p, s, S, T, new, A, B, e):
                return then
    return -1


@native
def shot(
    first: int, last: int, t: Array, u: Array, h_max: float, p: Array, z: Array, f: Array, T: Array, y: Array,
    Y: Array, carried: Array, e: Array,
) -> int:  # fmt: skip
    """As `shoot` of `loop.c`; T and Y have no rows where they are not wanted, e is room for exo."""
    n, ns, ny, sensitive = t.shape[0], z.shape[1], y.shape[1], T.shape[0] > 0
    columns = p.shape[0] + ns
    S, room = np.empty((ns, columns)), np.empty((ns if sensitive else 0, columns))
    s, new, A, B = np.empty(ns), np.empty(ns), np.empty(ns * ns), np.empty(ns * p.shape[0])
    C, D = np.empty(ny * ns), np.empty(ny * p.shape[0])
    for k in range(first, last):
        then = k if k + 1 == n else k + 1
        s[:], S[:] = z[k], 0.0
        for i in range(ns):
            S[i, p.shape[0] + i] = 1.0
        e[0], e[1] = t[k], 0.0
        fill(e, u, k, k, 0.0, 0.0)
        if Y.shape[0]:
            output_jac(s, e, p, y[k], C, D)
        else:
            output(s, e, p, y[k])
        if not (finite(s) and finite(y[k])) or (Y.shape[0] and not chain(C, D, S, Y[k])):
            return k
        dt = t[then] - t[k]
        steps = math.ceil(dt / h_max - 1e-9) if 0.0 < h_max < dt else 1
        for j in range(steps if dt > 0.0 else 0):
            if not sub_step(j, steps, t, u, k, then, then, p, s, S, room, new, A, B, e):
                return k
        if then > k:
            f[k] = s
            if sensitive:
                T[k] = S
            for i in range(ns):
                if carried[i] != 0:
                    z[then, i] = s[i]
    return -1
