"""One step of the observer (4.12)-(4.20) in discrete time, compiled; a recording is a loop of it.

In the errors xi the velocity equation reads xi2' = -(k2 + alpha1) xi2 + R - Phi sigm(xi2), with
R = x2' + alpha1 x2 + alpha5 x1hat - alpha4 u. The linear part is solved exactly for an R that is linear from sample to
sample (exponential, first-order hold); Phi sigm(xi2) is taken at the end of the step and solved for. So the step is
stable at any sampling time; Euler's diverges at 10 ms, and Runge and Kutta's at 10 to 20 ms. Taking Phi sigm(xi2) as
linear over the step was tried: better up to 10 ms, worse at 30, and not needed.
"""

from __future__ import annotations

from math import exp, expm1, fabs, inf
from typing import NamedTuple

import numpy as np

from detector.arithmetic.native import inlined, native
from detector.observer.alarm_rule import exceeds, threshold
from detector.observer.approximators import evaluate
from detector.observer.projection import project_ball, project_interval
from detector.observer.smooth_sign import solve
from recordings import Array, Integers

X1, X2, U, XI1, XI2, E1, B1, A1, A4, A5, RHO_LAST, PHI_LAST, SETTLED, COUNT, ALARM = range(15)
WEIGHTS = 15
"""Places in the state of the observer; the weights w1 and w2 follow. SETTLED is the time [s] since start or gap."""

RESIDUAL, RHO, PHI, OVER, ALARMED = range(5)
"""Columns of what a step gives: xi2, rho, Phi, whether the residual exceeds rho, whether there is an alarm."""

LEAST_ALPHA = 1e-9
"""Lower end of the sets of alpha1, alpha4, alpha5, which the source leaves open at zero."""


class Numbers(NamedTuple):
    """The constants of an observer, all floats, as the compiled step takes them; `Observer` says what they mean."""

    k1: float
    k2: float
    delta: float
    sigm: float
    printed_b1: float
    projection: float
    gain_moving: float
    gain_resting: float
    gain_alpha1: float
    gain_alpha4: float
    gain_alpha5: float
    bound_w1: float
    bound_w2: float
    bound_e1: float
    bound_b1: float
    bound_alpha1: float
    bound_alpha4: float
    bound_alpha5: float
    dead_zone: float
    alpha_dead_zone: float
    least_speed: float
    adapt_after_s: float
    freeze: float
    least_phi: float
    consecutive: float
    latch: float
    settle_s: float
    printed_residual: float


Decays = tuple[float, float, float, float, float, float]
"""What `decays` gives."""


@native
def advance(
    core: Array, centre: Array, dt: Array, x1: Array, x2: Array, u: Array, p: Numbers,
    base1: Array, powers1: Integers, base2: Array, powers2: Integers, output: Array, history: Array,
) -> None:  # fmt: skip
    """Run over samples, changing `core` (n_core,) in place. centre (n_core,) : middle of the sets of the laws.

    dt (n_samples) : time since the sample before [s]; 0 restarts at this sample, NaN skips it. output (n_samples, 5) :
    what each step gives; history (n_samples or 0, n_core) : the state after each sample.
    """
    s1, s2 = np.empty(powers1.shape[0]), np.empty(powers2.shape[0])
    values1, values2 = np.empty(base1.shape[0]), np.empty(base2.shape[0])
    for i in range(dt.shape[0]):
        over = False
        if dt[i] >= 0.0:
            speed = fabs(x2[i])
            evaluate(base1, powers1, x2[i], speed, values1, s1)
            evaluate(base2, powers2, speed, speed, values2, s2)
            over = step(core, centre, dt[i], x1[i], x2[i], u[i], s1, s2, decays(dt[i], core[A1], p.k1, p.k2), p)
        output[i, RESIDUAL], output[i, RHO], output[i, PHI] = core[XI2], core[RHO_LAST], core[PHI_LAST]
        output[i, OVER], output[i, ALARMED] = 1.0 if over else 0.0, core[ALARM]
        if history.shape[0] > 0:
            history[i, :] = core


@inlined
def step(
    core: Array, centre: Array, dt: float, x1: float, x2: float, u: float, s1: Array, s2: Array, f: Decays, p: Numbers
) -> bool:
    """One sample, changing `core` in place: threshold, errors, decision, adaptation. Whether xi2 exceeds rho.

    s1, s2 : regressors, used up as room for the adaptation; f : `decays` of dt.
    """
    speed = fabs(x2)
    phi = _phi(core, speed, s1, s2, p)
    core[PHI_LAST] = phi
    core[XI1], core[XI2], core[RHO_LAST], core[SETTLED], core[COUNT], core[ALARM], over = decided(
        core[XI1], core[XI2], core[X1], core[X2], core[U], core[A1], core[A4], core[A5], x1, x2, u, phi,
        core[SETTLED], core[COUNT], core[ALARM], dt, f,
        p.k2, p.delta, p.sigm, p.printed_residual, p.settle_s, p.consecutive, p.latch,
    )  # fmt: skip
    core[X1], core[X2], core[U] = x1, x2, u
    if dt > 0.0 and adapts(core, speed, p):
        if fabs(core[XI2]) >= p.dead_zone * core[RHO_LAST]:
            _weights(core, centre, dt, speed, s1, s2, p)
        if fabs(core[XI2]) >= p.alpha_dead_zone * core[RHO_LAST]:
            _alphas(core, centre, dt, p)
    return over


@inlined
def decided(
    xi1: float, xi2: float, x1_last: float, x2_last: float, u_last: float, a1: float, a4: float, a5: float,
    x1: float, x2: float, u: float, phi: float, settled: float, count: float, alarm: float, dt: float, f: Decays,
    k2: float, delta: float, sigm: float, printed_residual: float, settle_s: float, consecutive: float, latch: float,
) -> tuple[float, float, float, float, float, float, bool]:  # fmt: skip
    """Threshold, errors and decision of one sample in scalars, so that a fleet can afford them; dt = 0 restarts.

    Returns xi1, xi2, rho, the time since start or gap [s], the samples in a row above rho, the alarm, and whether xi2
    exceeds rho.
    """
    rho = threshold(phi, k2)
    if dt > 0.0:
        xi1, xi2 = next_errors(xi1, xi2, x1_last, x2_last, u_last, a1, a4, a5, x1, x2, u, phi, delta, sigm, f)
        settled += dt
    else:
        xi1, xi2, settled, count = 0.0, 0.0, 0.0, 0.0
    over = exceeds(xi2, rho, printed_residual)
    count = counted(count, over, settled, settle_s, consecutive)
    raised = count >= consecutive or (latch > 0.0 and alarm > 0.0)
    return xi1, xi2, rho, settled, count, 1.0 if raised else 0.0, over


@inlined
def _phi(core: Array, speed: float, s1: Array, s2: Array, p: Numbers) -> float:
    """Phi = abs(x2) w1' S1 + w2' S2 + abs(x2) e1 + b1, the bracket of (4.17)."""
    first, second = core[E1], core[B1]
    n1 = s1.shape[0]
    for i in range(n1):
        first += core[WEIGHTS + i] * s1[i]
    for i in range(s2.shape[0]):
        second += core[WEIGHTS + n1 + i] * s2[i]
    return max(speed * first + second, p.least_phi)


@inlined
def decays(dt: float, a1: float, k1: float, k2: float) -> Decays:
    """What a step does to the linear parts of xi1 and xi2: their decays and means over the step [s]; 1 / dt; and what
    a change of the drive over the step does to xi2 [s]. Zeros for dt = 0, where nothing decays.
    """
    if dt == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    rate = k2 + a1
    mean2, per_s = -expm1(-rate * dt) / rate, 1.0 / dt
    return exp(-k1 * dt), -expm1(-k1 * dt) / k1, exp(-rate * dt), mean2, per_s, (1.0 - mean2 * per_s) / rate


@inlined
def next_errors(
    xi1: float, xi2: float, x1_last: float, x2_last: float, u_last: float, a1: float, a4: float, a5: float,
    x1: float, x2: float, u: float, phi: float, delta: float, sigm: float, f: Decays,
) -> tuple[float, float]:  # fmt: skip
    """xi1 and xi2 after one step, (4.15)-(4.16): first without Phi sigm(xi2), then solved with it."""
    decay1, mean1, decay2, mean2, per_s, ramp = f
    slope = (x2 - x2_last) * per_s
    free1 = decay1 * xi1 + mean1 * ((x1 - x1_last) * per_s - 0.5 * (x2 + x2_last))
    begin = slope + a1 * x2_last + a5 * (x1_last - xi1) - a4 * u_last
    end = slope + a1 * x2 + a5 * (x1 - free1) - a4 * u
    free2 = decay2 * xi2 + mean2 * begin + (end - begin) * ramp
    after2 = solve(free2, mean2 * phi, delta, sigm)
    return free1 + mean1 * a5 * after2, after2


@inlined
def counted(count: float, over: bool, settled: float, settle_s: float, consecutive: float) -> float:
    """How many samples in a row are above the threshold; none while the errors settle."""
    return min(count + 1.0, consecutive) if over and settled >= settle_s else 0.0


@inlined
def adapts(core: Array, speed: float, p: Numbers) -> bool:
    """Whether the laws (4.20) may run: in motion, some time after a start, and not frozen by an alarm."""
    frozen = p.freeze > 0.0 and core[ALARM] > 0.0
    return not frozen and core[SETTLED] >= p.adapt_after_s and speed >= p.least_speed


@inlined
def _weights(core: Array, centre: Array, dt: float, speed: float, s1: Array, s2: Array, p: Numbers) -> None:
    """w1, w2, e1 and b1 of (4.20), which only grow what Phi counts, as b1 does not under the printed law."""
    end1 = WEIGHTS + s1.shape[0]
    end2 = end1 + s2.shape[0]
    amount, moving = dt * p.gain_resting * fabs(core[XI2]), dt * p.gain_moving * fabs(core[XI2])
    for i in range(s1.shape[0]):
        s1[i] *= moving * speed
    for i in range(s2.shape[0]):
        s2[i] *= amount
    project_ball(core[WEIGHTS:end1], s1, centre[WEIGHTS:end1], p.bound_w1, p.projection)
    project_ball(core[end1:end2], s2, centre[end1:end2], p.bound_w2, p.projection)
    core[E1] = project_interval(core[E1], moving * speed, centre[E1], p.bound_e1, -inf, p.projection)
    rise = dt * p.gain_resting * core[XI2] if p.printed_b1 > 0.0 else amount
    core[B1] = project_interval(core[B1], rise, centre[B1], p.bound_b1, -inf, p.projection)


@inlined
def _alphas(core: Array, centre: Array, dt: float, p: Numbers) -> None:
    """alpha1, alpha4 and alpha5 of (4.20); the law of alpha5 is -xi2 (xi1 + x1hat) = -xi2 x1."""
    amount = dt * core[XI2]
    steps = (-p.gain_alpha1 * amount * (core[X2] - core[XI2]), p.gain_alpha4 * amount * core[U],
             -p.gain_alpha5 * amount * core[X1])  # fmt: skip
    core[A1] = project_interval(core[A1], steps[0], centre[A1], p.bound_alpha1, LEAST_ALPHA, p.projection)
    core[A4] = project_interval(core[A4], steps[1], centre[A4], p.bound_alpha4, LEAST_ALPHA, p.projection)
    core[A5] = project_interval(core[A5], steps[2], centre[A5], p.bound_alpha5, LEAST_ALPHA, p.projection)
