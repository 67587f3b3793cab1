"""The source's statements about detection, Section 4.3, each in a form that holds; the print by name where it differs.

Throughout k = k2 + alpha1 and kappa = k / k2, so that the threshold is rho = abs(Phi) / k2 = kappa abs(Phi) / k.

>>> round(detection_bound(b_least=1.8, a_most=0.4, phi=1.39, k2=200.0, alpha1=1.8142, form="printed"), 4)
0.0279
>>> detection_bound(b_least=1.8, a_most=0.4, phi=1.39, k2=200.0, alpha1=1.8142)
inf
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, expm1, inf, isinf, log
from typing import Literal

import numpy as np

from recordings import Array, BadInput

FormulaText = Literal["corrected", "printed"]

SIGN_ERROR = 0.27846454276107374
"""Largest y (1 - tanh y): abs(eps_s(xi) xi) <= SIGN_ERROR delta for sigm = tanh(xi / delta), below (4.24)."""


def kappa(k2: float, alpha1: float) -> float:
    """(k2 + alpha1) / k2: how much the threshold exceeds abs(Phi) / (k2 + alpha1)."""
    return (k2 + alpha1) / k2


def bristle_bound(z0: float, fs: float, sigma0: float) -> float:
    """Largest abs(z(t)) [m] from z(0) = z0 at any velocity: max(abs(z0), fs / sigma0).

    It takes the place of (4.7), input-to-state stability, which does not hold: with x2 = 0, z stays where it is.
    fs : the larger of stiction and Coulomb force [N]; sigma0 [N/m].
    """
    return max(abs(z0), fs / sigma0)


def velocity_error_bound(t: float, xi2_0: float, a_most: float, k2: float, alpha1: float) -> float:
    """Largest abs(xi2(t)) without a fault, t seconds on: abs(xi2(0)) exp(-k t) + sup abs(A) / k.

    It takes the place of the set of Theorem 1, abs(xi2) <= abs(Phi) / k, which is neither entered nor kept in general:
    V contains the parameter errors, and Phi moves. a_most : sup abs(A) of (4.29) over 0..t [acceleration].
    """
    k = k2 + alpha1
    return abs(xi2_0) * exp(-k * t) + a_most / k


def position_error_bound(t: float, xi1_0: float, xi2_most: float, k1: float, bound_alpha5: float) -> float:
    """Largest abs(xi1(t)) [m]: abs(xi1(0)) exp(-k1 t) + Mg sup abs(xi2) (1 - exp(-k1 t)) / k1, from (4.15)."""
    return abs(xi1_0) * exp(-k1 * t) - bound_alpha5 * xi2_most * expm1(-k1 * t) / k1


def no_false_alarm(a_most: float, phi_least: float, k2: float, alpha1: float) -> bool:
    """Whether (4.27) cannot alarm without a fault, once the start has decayed: sup abs(A) < kappa inf abs(Phi).

    The remark after (4.40), abs(A) >= abs(Phi), says nearly the opposite and is not true.
    """
    return a_most < kappa(k2, alpha1) * abs(phi_least)


@dataclass(frozen=True)
class Condition:
    """Condition (4.32) along a run. time_s (n_samples,) [s]; margin (n_samples,): left side minus right, [velocity];
    time after which it first holds: `holds_s`, None when it never does.
    """

    time_s: Array
    margin: Array

    @property
    def holds_s(self) -> float | None:
        """First time at which the margin is not negative."""
        hits = self.time_s[self.margin >= 0]
        return float(hits[0]) if len(hits) else None


def detectability(
    time_s: Array, a: Array, b: Array, rho: Array, *, k2: float, alpha1: float, form: FormulaText = "corrected"
) -> Condition:
    """Condition (4.32) with t1 at the first sample and t2 at each one. Where it holds, abs(xi2(t2)) >= rho(t2).

    a, b : A of (4.29) and the fault's B of (4.30)-(4.31), with its time profile, [acceleration]; rho : the threshold
    [velocity]; all (n_samples,). The corrected form asks for rho(t2) + rho(t1) exp(-k (t2 - t1)), because the
    threshold moves; the printed one for one rho, taken at t2. Detection is at t2 or earlier. What the theorem assumes,
    abs(xi2(t1)) <= rho(t1), is the caller's to see to. The printed form guarantees detection only while rho does not
    fall. Raises BadInput for rows that do not match or times that do not rise.
    """
    if not len(time_s) == len(a) == len(b) == len(rho) > 1 or (np.diff(time_s) <= 0).any():
        raise BadInput("condition (4.32)", "rows of different length, fewer than two, or times that do not rise",
                       "give time_s, a, b and rho of one length with rising times")  # fmt: skip
    k = k2 + alpha1
    by_model, by_fault = (np.abs(_filtered(time_s, row, k)) for row in (a, b))
    begin = rho[0] if form == "corrected" else rho
    margin = by_fault - rho - begin * np.exp(-k * (time_s - time_s[0])) - by_model
    return Condition(time_s, margin)


def _filtered(time: Array, row: Array, k: float) -> Array:
    """Integral of exp(-k (t - tau)) row(tau) from the first time to each, exact for rows linear between samples."""
    out, dt = np.zeros(len(row)), np.diff(time)
    fade, mean = np.exp(-k * dt), -np.expm1(-k * dt) / k
    gain = mean * row[:-1] + np.diff(row) / k * (1.0 - mean / dt)
    for i in range(len(dt)):
        out[i + 1] = fade[i] * out[i] + gain[i]
    return out


def detection_bound(
    *, b_least: float, a_most: float, phi: float, k2: float, alpha1: float, t1: float = 0.0, rate: float = inf,
    form: FormulaText = "corrected",
) -> float:  # fmt: skip
    """Upper bound of the detection time after the onset [s]: (4.35) abrupt, (4.33)-(4.34) incipient.

    It holds when from t1 to the time returned B keeps its sign and abs(B) >= b_least, abs(A) <= a_most,
    abs(Phi) <= phi, and abs(xi2(t1)) <= rho. The corrected form uses kappa sup abs(Phi) where the print has abs(Phi),
    since rho is abs(Phi) / k2 and not abs(Phi) / (k2 + alpha1). inf: no detection is promised.

    b_least, a_most, phi [acceleration]; t1 : seconds after the onset at which the conditions begin to hold; rate : pi
    of the profile 1 - exp(-pi t) [1/s], inf for an abrupt fault.

    >>> 0.007 < detection_bound(b_least=3.4, a_most=0.9, phi=1.6, k2=200.0, alpha1=1.8142) < 0.0086
    True
    """
    least = min(b_least, k2, t1 + 1.0, rate)
    if least <= 0 or a_most < 0 or phi < 0:
        raise BadInput(
            "detection time", "a bound or rate is negative or zero", "give the sizes abs(B), abs(A), abs(Phi)"
        )
    k, level = k2 + alpha1, phi * (kappa(k2, alpha1) if form == "corrected" else 1.0)
    if b_least - a_most <= level:
        return inf
    if isinf(rate):
        return t1 + log((b_least - a_most + level) / (b_least - a_most - level)) / k
    return _incipient(b_least, a_most, level, k, t1, rate)


def _incipient(b: float, a: float, level: float, k: float, t1: float, rate: float) -> float:
    """The root of (4.33); both sides settle, so that it lies within the slower of the two decays."""
    from scipy.optimize import brentq

    begin = _growth(t1, b, k, rate) + level - a

    def margin(t: float) -> float:
        return _growth(t, b, k, rate) - begin * exp(-k * (t - t1)) - a - level

    end = t1 + 1.0 / min(k, rate)
    while margin(end) < 0:
        end = t1 + 2.0 * (end - t1)
    return float(brentq(margin, t1, end, xtol=1e-12))


def _growth(t: float, b: float, k: float, rate: float) -> float:
    """g of (4.34), with its limit at k = rate; the common factor of (4.37) cancels there as well."""
    if abs(k - rate) < 1e-9 * k:
        rate *= 1.0 - 1e-6
    return b / (k - rate) * (k - rate - k * exp(-rate * t))
