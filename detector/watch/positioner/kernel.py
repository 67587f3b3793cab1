"""The compiled loop of a positioner and its pneumatic actuator, and the slow fit of its constants in service.

A positioner sees the set point late, and lets air in or out while the stem is out of its dead band: in proportion to
the error, within a limit of speed each way. Otherwise the air is trapped, and the process pressure moves the stem
against it. A play stands between the two. The loop never sees the measured position after its start.
"""

from __future__ import annotations

from math import ceil, exp, fabs, sqrt

import numpy as np

from detector.arithmetic.native import inlined, native
from recordings import Array

SYMBOLS = ("gain", "up", "down", "push", "slope", "play", "dead", "late")
"""Constants, in shares of the learned stroke: gain of the positioner [1/s]; limits of speed [1/s]; what the pressure
drop adds to the position at the middle of the stroke [1], and the rise of that over the stroke [1]; play, half the dead
band [1]; lag of the set point [s]. The positions that the set point means at evenly spread knots [1] follow."""

GAIN, UP, DOWN, PUSH, SLOPE, PLAY, DEAD, LATE = range(8)
CURVE = len(SYMBOLS)

AIR, STEM, GOAL = range(3)
N_LOOP = 3
"""What a loop remembers: the position that the air alone would give, the position, and the set point it sees."""

TIME, SETPOINT, DROP, SINCE, STILL, AT_LOOP, AT_VALVE = range(7)
LOOPS = 7
"""Places in the state: time of the last sample [s], its inputs, time since the start [s] (below 0: none yet) and since
loop or valve moved [s], where they were then; the loops, the shares of the changes and their covariance follow."""

LONGEST = 0.05
"""Longest step of the loop [s]."""

NOISY = 5.0
"""The measured position has moved when it is so many deviations away; that of the loop, which has no noise, one."""

OUTSIDE = 0.05
"""A loop starts where the stem is at most so far outside the learned stroke."""

UNSURE = 0.5
"""After a start each change is as likely as not by such a share: nobody knows how much air is trapped."""

LOUDEST = 3.0
"""A residual moves the constants as if it were this many deviations at most."""


@inlined
def meant(setpoint, low, width, constants):  # type: ignore[no-untyped-def]
    """The position that a set point means: straight between knots from low on, a width apart, and beyond them."""
    n = len(constants) - CURVE
    at = (setpoint - low) / width
    k = min(max(int(at), 0), n - 2)
    return constants[CURVE + k] + (at - k) * (constants[CURVE + k + 1] - constants[CURVE + k])


@inlined
def advance_loop(loop, before, after, drop_before, drop_after, dt, constants):  # type: ignore[no-untyped-def]
    """A loop (N_LOOP,) from one sample to the next, in place; inputs are straight between them."""
    n = max(ceil(dt / LONGEST - 1e-9), 1)
    h = dt / n
    late = 1.0 - exp(-h / max(constants[LATE], 1e-3))
    half = 0.5 * constants[PLAY]
    for j in range(n):
        part = (j + 1.0) / n
        loop[GOAL] += late * (before + (after - before) * part - loop[GOAL])
        error = loop[GOAL] - loop[STEM]
        rate = 0.0
        if error > constants[DEAD]:
            rate = min((error - constants[DEAD]) * constants[GAIN], constants[UP])
        elif error < -constants[DEAD]:
            rate = max((error + constants[DEAD]) * constants[GAIN], -constants[DOWN])
        loop[AIR] += h * rate
        push = constants[PUSH] * (1.0 + constants[SLOPE] * (loop[STEM] - 0.5))
        pushed = loop[AIR] + push * (drop_before + (drop_after - drop_before) * part)
        loop[STEM] = min(max(loop[STEM], pushed - half), pushed + half)


@native
def follow(rows: Array, gap_s: float, low: float, width: float, constants: Array, out: Array) -> None:
    """The loop alone over rows (n, 4) as `watch` has them, started anew after a gap; out (n,) : its position."""
    loop, before = np.empty(N_LOOP), 0.0
    for k in range(len(rows)):
        after, dt = meant(rows[k, 1], low, width, constants), rows[k, 0] - rows[k - 1, 0]
        if k == 0 or dt > gap_s:
            _start(loop, rows[k, 3], after)
        else:
            advance_loop(loop, before, after, rows[k - 1, 2], rows[k, 2], dt, constants)
        before = after
        out[k] = loop[STEM]


@inlined
def _start(loop, position, goal):  # type: ignore[no-untyped-def]
    """A loop at rest at a position."""
    loop[AIR] = loop[STEM] = position
    loop[GOAL] = goal


@native
def watch(
    state: Array, rows: Array, frozen: bool, constants: Array, numbers: Array, drifts: Array, residuals: Array,
    answers: Array,
) -> None:  # fmt: skip
    """Samples into the state, in place.

    rows (n, 4) : time [s], set point, drop, position; NaN where one is missing, and the sample is passed over; frozen :
    whether the constants stay; constants (n_answers, n_constants) : of the loop, then with each of the changes but the
    last, an offset; drifts (n_answers,) : growth of the variance of their shares in a
    sample; residuals (n,) : over the usual deviation, NaN where they say nothing; answers (n, n_answers) : what each
    change adds to the position, over the same.
    numbers : lowest knot and width; gap_s, settle_s : a silence that restarts the loops, and for how long after that a
    sample says nothing, or after the last motion still something [s]; offset; deviation; learned ranges of set point
    and drop, low and high.
    """
    low, width, gap_s, settle_s, offset, deviation = numbers[:6]
    n = constants.shape[0]
    shares = LOOPS + N_LOOP * n
    spread = shares + n
    for k in range(len(rows)):
        residuals[k] = np.nan
        time, setpoint, drop, x = rows[k]
        if not (np.isfinite(time) and np.isfinite(setpoint) and np.isfinite(drop) and np.isfinite(x)):
            continue
        dt = time - state[TIME]
        within = numbers[6] <= setpoint <= numbers[7] and numbers[8] <= drop <= numbers[9]
        if state[SINCE] < settle_s:
            within = within and -OUTSIDE <= x <= 1.0 + OUTSIDE  # a stem on its stop comes back late
        if state[SINCE] < 0.0 or not 0.0 <= dt <= gap_s:
            _forget(state[spread:], drifts)
            within = False
        if not within:
            state[SINCE], state[STILL], state[AT_LOOP], state[AT_VALVE] = 0.0, settle_s, x, x
            for i in range(n):
                loop = state[LOOPS + N_LOOP * i : LOOPS + N_LOOP * (i + 1)]
                _start(loop, x, meant(setpoint, low, width, constants[i]))
        else:
            state[SINCE] += dt
            for i in range(n):
                before = meant(state[SETPOINT], low, width, constants[i])
                after = meant(setpoint, low, width, constants[i])
                loop = state[LOOPS + N_LOOP * i : LOOPS + N_LOOP * (i + 1)]
                advance_loop(loop, before, after, state[DROP], drop, dt, constants[i])
        state[TIME], state[SETPOINT], state[DROP] = time, setpoint, drop
        stem = state[LOOPS + STEM]
        state[STILL] += max(dt, 0.0)
        if fabs(stem - state[AT_LOOP]) > deviation or fabs(x - state[AT_VALVE]) > NOISY * deviation:
            state[STILL], state[AT_LOOP], state[AT_VALVE] = 0.0, stem, x
        left = (x - stem) / deviation
        for i in range(n - 1):
            answers[k, i] = (state[LOOPS + N_LOOP * (i + 1) + STEM] - stem) / deviation
        answers[k, n - 1] = offset / deviation
        for i in range(n):
            left -= answers[k, i] * state[shares + i]
        if state[SINCE] >= settle_s and state[STILL] < settle_s:
            residuals[k] = _innovation(state[shares:spread], state[spread:], answers[k], drifts, left, frozen)


@inlined
def _forget(spread, drifts):  # type: ignore[no-untyped-def]
    """The shares are unsure anew, where the data show the change at all."""
    spread[:] = 0.0
    for i in range(len(drifts)):
        if drifts[i] > 0.0:
            spread[i * len(drifts) + i] = UNSURE**2


@inlined
def _innovation(shares, spread, answers, drifts, left, frozen):  # type: ignore[no-untyped-def]
    """What is left over its deviation, and a step of the Kalman filter of the shares, each a slow random walk within
    one change up or down.
    """
    n = len(shares)
    gain, variance = np.empty(n), 1.0
    for i in range(n):
        gain[i] = 0.0
        for j in range(n):
            gain[i] += spread[i * n + j] * answers[j]
    for i in range(n):
        variance += answers[i] * gain[i]
    away = left / sqrt(variance)
    if not frozen:
        told = min(max(away, -LOUDEST), LOUDEST) / sqrt(variance)
        for i in range(n):
            shares[i] = min(max(shares[i] + gain[i] * told, -1.0), 1.0)
            for j in range(n):
                spread[i * n + j] -= gain[i] * gain[j] / variance
        for i in range(n):
            at = i * n + i
            spread[at] = min(spread[at] + drifts[i], UNSURE**2)
    return away
