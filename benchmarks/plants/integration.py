"""A valve written a second time, from the physics: the truth that `benchmarks.trace` judges by.

Nothing here comes from `simulator`: the equations are stated as a plain first-order system and integrated by the
classical Runge-Kutta scheme in steps of 40 us, divided further where the bristle is fast. So the truth shares neither
formulas nor scheme nor step nor code with the kernel that is fitted to it.

    m dv/dt = u_stem - K x - F0 - (sigma0 z + sigma1 dz/dt + sigma2 v) - extras
    dz/dt   = v - sigma0 abs(v) z / g

What can be added to it are the fields of `Physics`; each is off at its default. `benchmarks.plants.effects` says which
fields make which effect.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from benchmarks.plants.physics import Physics
from recordings import Array

STEP = 4e-5
"""Longest step [s]."""
REACH = 0.8
"""Largest share of the bristle's relaxation time that one step takes."""
ELEMENTS = 8
"""Elements of each stack of play operators at most."""
STATES = 14
HISTORY = 4096
"""Past velocities that are kept, one per `STEP`."""


compiled = njit(cache=True, error_model="numpy")


@compiled
def _signal(t, table, rate):
    """A sampled signal, straight between its samples and constant outside."""
    place = min(max(t * rate, 0.0), len(table) - 1.0)
    i = min(int(place), len(table) - 2)
    return table[i] + (place - i) * (table[i + 1] - table[i])


@compiled
def _dragged(anchor, drive, half):
    """An anchor that a drive takes along at a distance of `half`."""
    return min(max(anchor, drive - half), drive + half)


@compiled
def _recorded_force(t, u, rate, p):
    """The force as it really acts at the entrance."""
    t -= p.delay
    if p.quantum > 0.0:
        held = _signal(math.floor(t / p.quantum_t + 1e-9) * p.quantum_t, u, rate)
        return round(held / p.quantum) * p.quantum
    return (1.0 + p.gain) * _signal(t, u, rate)


@compiled
def _looped(u, p, stack, dahl):
    """The force behind the hysteresis of the actuator, given where its anchors are."""
    if p.loop > 0.0:
        behind = 0.0
        for i in range(p.loop_n):
            half = p.loop_r * (i + 1) / p.loop_n
            behind += (u - _dragged(stack[i], u, half)) / half
        u -= p.loop * behind / p.loop_n
    return u - dahl


@compiled
def _course(t, rate, end, T):
    """A drift: linear, or towards an end."""
    return rate * t if end == 0.0 else rate * t + end * (1.0 - math.exp(-t / T))


@compiled
def _along(x, p):
    """How friction varies along the stroke, a factor."""
    d = (x - p.spot_x) / p.spot_w
    rise = math.exp(-d * d) if p.spot_hann == 0.0 else 0.5 + 0.5 * math.cos(math.pi * min(abs(d), 1.0))
    return 1.0 + p.spot * rise + p.slope * x + p.wave * math.sin(2.0 * math.pi * x / p.wave_l)


@compiled
def _bells(x, v, p):
    """How friction varies in three bells along the stroke, each loudest at rest, a factor."""
    d = (x - p.bell_x) / p.bell_w
    here = p.bell_1 * math.exp(-((d + 1.5) ** 2)) + p.bell_2 * math.exp(-d * d) + p.bell_3 * math.exp(-((d - 1.5) ** 2))
    return 1.0 + here * math.exp(-((v / p.bell_u) ** 2))


@compiled
def _level(t, x, v, s, u, read, closed, p):
    """Friction level [N]: Stribeck's curve at the velocity `read`, times everything that makes it vary."""
    steep = (read / p.vs) ** 2
    if p.curve != 0.0 and read != 0.0:
        steep *= (abs(read) / 5e-3) ** -p.curve
    away = math.exp(-steep)
    way = (v > 0.0) - (v < 0.0)
    g = p.fc * (1.0 + p.asym_coulomb * way) + (p.fs - p.fc) * away
    if p.spot != 0.0 or p.slope != 0.0 or p.wave != 0.0:
        g *= _along(x, p)
    if p.bell_1 != 0.0 or p.bell_2 != 0.0 or p.bell_3 != 0.0:
        g *= _bells(x, v, p)
    if p.load != 0.0:
        g *= 1.0 + p.load * abs(u) ** p.load_e
    if p.dwell != 0.0:
        rested = s[3] / (s[3] + p.dwell_t) if p.dwell_hyperbola > 0.0 else 1.0 - math.exp(-s[3] / p.dwell_t)
        g *= 1.0 + p.dwell * rested
    g *= (1.0 + p.asym_all * way) * (1.0 + _course(t, p.drift, p.drift_end, p.drift_T))
    if t >= p.jump_t:
        g *= 1.0 + p.jump
    if closed:
        g *= 1.0 + p.clamp
    if p.accel != 0.0:
        g *= 1.0 + p.accel * abs(v - s[12]) / 5e-3
    return max(g, 0.02 * p.fc)


@compiled
def _extras(t, x, v, s, stack, p):
    """Forces against the motion [N] beside spring, friction and inertia."""
    away = x - p.cubic_x
    f = p.visc * max(v, 0.0) + p.cubic * away * away * away
    if p.drag != 0.0:
        f += p.drag * abs(v) ** p.drag_e * ((v > 0.0) - (v < 0.0))
    if p.stop != 0.0 and x > p.stop_x:
        f += p.stop * (x - p.stop_x) ** p.stop_e
    if p.flow != 0.0:
        d = (x - p.flow_x) / p.flow_w
        f += p.flow * math.exp(-d * d) if p.flow_bell > 0.0 else p.flow / (1.0 + d * d)
    if p.hum != 0.0:
        tone = math.sin(2.0 * math.pi * p.hum_f * t + p.hum_phase)
        f += p.hum * (2.0 / math.pi * math.asin(tone) if p.hum_triangle > 0.0 else tone)
    if p.screw != 0.0:
        turn = 2.0 * math.pi * x / p.screw_l + p.screw_phase
        f += p.screw * (math.sin(turn) + p.screw_h * math.sin(2.0 * turn))
    if p.snap != 0.0:
        f += 0.5 * p.snap * math.tanh((x - p.snap_x) / p.snap_w)
    f += _course(t, p.offset, p.offset_end, p.offset_T)
    f += p.creep * (x - s[5]) + p.hose_k * (x - s[6]) + p.hose_c * (v - s[7])
    if p.slip_f > 0.0:
        weights = 0.0
        for i in range(p.slip_n):
            weight = 1.0 - p.slip_ramp * (i + 0.5) / p.slip_n
            weights += weight
        for i in range(p.slip_n):
            weight = (1.0 - p.slip_ramp * (i + 0.5) / p.slip_n) / weights
            limit = p.slip_d * (i + 1) / p.slip_n
            f += p.slip_f * weight * (x - _dragged(stack[i], x, limit)) / limit
    return f


@compiled
def _rates(t, s, d, late, u, rate, stacks, dahl, closed, seen, p):
    """ds/dt into d.

    s: x, v, z, time at rest, lagged velocity, creep, hose x and v, two lags of the input, two of the output, filtered
    velocity, spare. late: the velocity of a while ago; stacks (3, ELEMENTS): anchors of slip, loop and play; seen: the
    position of a while ago, which a sensor's lag reads.
    """
    x, v, z = s[0], s[1], s[2]
    force = _looped(_recorded_force(t, u, rate, p), p, stacks[1], dahl)
    d[8] = (force - s[8]) / p.lag if p.lag > 0.0 else 0.0
    force = s[8] if p.lag > 0.0 else force
    d[9] = (force - s[9]) / p.lag2 if p.lag2 > 0.0 else 0.0
    force = s[9] if p.lag2 > 0.0 else force
    read = late if p.late > 0.0 else (s[4] if p.late_lag > 0.0 else v)
    g = _level(t, x, v, s, force, read, closed, p)
    dz = v - p.s0 * abs(v) * z / g
    friction = p.s0 * z + p.s1 * dz + p.s2 * v
    d[0], d[2] = v, dz
    d[1] = (force - p.K * x - p.F0 - friction - _extras(t, x, v, s, stacks[0], p)) / p.m
    d[3] = 1.0 - s[3] * abs(v) / p.dwell_d if p.dwell != 0.0 else 0.0
    d[4] = (v - s[4]) / p.late_lag if p.late_lag > 0.0 else 0.0
    d[5] = (x - s[5]) / p.creep_t if p.creep > 0.0 else 0.0
    d[6] = s[7] if p.hose_m > 0.0 else 0.0
    d[7] = (p.hose_k * (x - s[6]) + p.hose_c * (v - s[7])) / p.hose_m if p.hose_m > 0.0 else 0.0
    reading = _dragged(stacks[2, 0], x, 0.5 * p.play) if p.out_delay == 0.0 else seen
    d[10] = (reading - s[10]) / p.out_lag if p.out_lag > 0.0 else 0.0
    d[11] = (s[10] - s[11]) / p.out_lag2 if p.out_lag2 > 0.0 else 0.0
    d[12] = (v - s[12]) / 5e-3 if p.accel != 0.0 else 0.0


@compiled
def _advance(t, h, s, work, late, u, rate, stacks, dahl, closed, seen, p):
    """One step of the classical Runge-Kutta scheme, in place."""
    k1, k2, k3, k4, mid = work[0], work[1], work[2], work[3], work[4]
    _rates(t, s, k1, late, u, rate, stacks, dahl, closed, seen, p)
    for i in range(STATES):
        mid[i] = s[i] + 0.5 * h * k1[i]
    _rates(t + 0.5 * h, mid, k2, late, u, rate, stacks, dahl, closed, seen, p)
    for i in range(STATES):
        mid[i] = s[i] + 0.5 * h * k2[i]
    _rates(t + 0.5 * h, mid, k3, late, u, rate, stacks, dahl, closed, seen, p)
    for i in range(STATES):
        mid[i] = s[i] + h * k3[i]
    _rates(t + h, mid, k4, late, u, rate, stacks, dahl, closed, seen, p)
    for i in range(STATES):
        s[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])


@compiled
def _drag_along(t, s, u, rate, stacks, dahl, before, p):
    """Move all anchors to where the step left them. Returns the state of Dahl's loop and the force it has seen."""
    for i in range(p.slip_n):
        stacks[0, i] = _dragged(stacks[0, i], s[0], p.slip_d * (i + 1) / p.slip_n)
    stacks[2, 0] = _dragged(stacks[2, 0], s[0], 0.5 * p.play)
    if p.loop == 0.0 and p.dahl == 0.0:
        return dahl, before
    force = _recorded_force(t, u, rate, p)
    for i in range(p.loop_n):
        stacks[1, i] = _dragged(stacks[1, i], force, p.loop_r * (i + 1) / p.loop_n)
    if p.dahl > 0.0 and force != before:
        way = 1.0 if force > before else -1.0
        dahl = way * p.dahl + (dahl - way * p.dahl) * math.exp(-abs(force - before) / p.dahl_r)
    return dahl, force


@compiled
def _reading(t, s, anchor, seen, p):
    """What the sensor shows [m], without noise."""
    y = seen if p.out_delay > 0.0 else _dragged(anchor, s[0], 0.5 * p.play)
    if p.out_lag > 0.0:
        y = s[11] if p.out_lag2 > 0.0 else s[10]
    part = y / p.stroke
    bow = part * (1.0 - part)
    y += 4.0 * p.arch * bow + p.arch_sine * math.sin(math.pi * part) + p.ess * 10.392 * bow * (1.0 - 2.0 * part)
    return min(y + _course(t, p.zero, p.zero_end, p.zero_T), p.top)


@compiled
def _past(ring, now, age):
    """What a ring held a while ago (age in steps, now the steps made)."""
    place = max(now - age, 0.0)
    i = int(place)
    first = ring[i % HISTORY]
    return first + (place - i) * (ring[min(i + 1, now) % HISTORY] - first)


@compiled
def _sub_steps(s, h, p):
    """Into how many parts a step is divided, by the plain Stribeck level: effects change it by tens of percent."""
    g = p.fc + (p.fs - p.fc) * math.exp(-((s[1] / p.vs) ** 2))
    return max(1, math.ceil(h * p.s0 * abs(s[1]) / g / REACH))


@compiled
def _integrate(u, rate, closed_at, s, stacks, p, fine):
    """Readings [m] and hidden x, v, z at the samples of u, from the states s and anchors, in place."""
    n = len(u)
    per = math.ceil(1.0 / rate / fine)
    h = 1.0 / rate / per
    out = np.empty((n, 4))
    work = np.zeros((5, STATES))
    xs, vs = np.full(HISTORY, s[0]), np.full(HISTORY, s[1])
    dahl, before, steps = 0.0, _recorded_force(0.0, u, rate, p), 0
    for k in range(n):
        t = k / rate
        seen = _past(xs, steps, p.out_delay / h)
        out[k, 0] = _reading(t, s, stacks[2, 0], seen, p)
        out[k, 1], out[k, 2], out[k, 3] = s[0], s[1], s[2]
        if k == n - 1:
            break
        closed = closed_at[k]
        for j in range(per):
            now = t + j * h
            late, seen = _past(vs, steps, p.late / h), _past(xs, steps, p.out_delay / h)
            parts = _sub_steps(s, h, p)
            for i in range(parts):
                _advance(now + i * h / parts, h / parts, s, work, late, u, rate, stacks, dahl, closed, seen, p)
                dahl, before = _drag_along(now + (i + 1) * h / parts, s, u, rate, stacks, dahl, before, p)
            steps += 1
            xs[steps % HISTORY], vs[steps % HISTORY] = s[0], s[1]
    return out


def integrate(physics: Physics, force: Array, rate: float, *, closed: Array | None = None, step: float = STEP) -> Array:
    """Run the plant on a force [N] (n_samples,) at `rate` [Hz], from rest at the force's balance.

    closed (n_samples,) bool : when a clamp holds the stem. Returns (n_samples, 4): reading [m] without noise, and the
    hidden position [m], velocity [m/s] and bristle deflection [m].
    """
    p = _tidy(physics)
    start = (force[0] - p.F0) / p.K if p.K > 0 else 0.0
    s = np.zeros(STATES)
    s[0] = s[5] = s[6] = s[10] = s[11] = start
    s[8] = s[9] = (1.0 + p.gain) * force[0]
    stacks = np.zeros((3, ELEMENTS))
    stacks[0], stacks[1], stacks[2] = start, (1.0 + p.gain) * force[0], start + 0.5 * p.play * p.play_at
    shut = np.zeros(len(force), np.bool_) if closed is None else np.asarray(closed, np.bool_)
    return _integrate(np.ascontiguousarray(force, float), float(rate), shut, s, stacks, p, step)


def _tidy(p: Physics) -> Physics:
    """Every field in the type of its default, so that the integrator is compiled once."""
    whole = ("slip_n", "loop_n")
    return Physics(*(int(v) if name in whole else float(v) for name, v in zip(Physics._fields, p, strict=True)))
