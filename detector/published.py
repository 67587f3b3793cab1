"""The two observers of the source as far as it states them; what it leaves open is fitted, and marked as such.

A reconstruction, not a confirmation: two published times are met with two free constants.
"""

from __future__ import annotations

from math import sqrt

from detector.observer.alarm_rule import AlarmRule
from detector.observer.observer import Observer, Start
from detector.observer.velocity import HighPass


def section_4_4(k2: float = 200.0) -> Observer:
    """Section 4.4: velocity measured, k1 = 100, unit adaptation gains.

    Fitted: b1(0) = 1.58 and delta = 0.0612, with alpha1, alpha4, alpha5 started at the true values of the plant. The
    times at which condition (4.32) becomes true are then the published detection times; the residual itself crosses
    the threshold earlier, at about half the time.
    """
    start = Start(alpha1=sqrt(2.0) + 0.4, alpha4=1.0, alpha5=1.0, b1=1.58)
    return Observer(k1=100.0, k2=k2, start=start, delta=0.0612, rule=AlarmRule(consecutive=1))


def chapter_5(
    *, tau_s: float = 1e-3, alpha4: float = 0.05, alpha5: float = 1.0, gain: float = 300.0, b1: float = 0.0,
    slope: float = 1000.0,
) -> Observer:  # fmt: skip
    """Chapter 5, for the play-form DAMADICS actuator at 2.5 ms without noise: x1 in m, u = CV, k1 = 100, k2 = 400.

    Fitted: all arguments. tau_s : of the high-pass filter; alpha4, alpha5 : starts; gain : of w1, w2, e1, b1; b1 : its
    start; slope : of sigm = 2 / (1 + exp(-slope xi2)) - 1. Alarms of the first 5 s are ignored: the published
    decisions show one too.
    """
    return Observer(
        k1=100.0, k2=400.0, start=Start(1.0, alpha4, alpha5, b1=b1), weight_gain=gain, delta=2.0 / slope,
        velocity=HighPass(tau_s), rule=AlarmRule(consecutive=2, settle_s=5.0),
    )  # fmt: skip
