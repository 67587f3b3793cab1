"""Threshold (4.27), the rule of consecutive samples, latch and settling time."""

from __future__ import annotations

from dataclasses import dataclass
from math import fabs
from typing import Literal

from detector.arithmetic.native import native

ABSOLUTE, PRINTED = 0.0, 1.0


@dataclass(frozen=True)
class AlarmRule:
    """When a residual above the threshold becomes an alarm.

    consecutive : samples in a row above it; latch : an alarm stays until the state is restarted; settle_s : no
    alarm before this long [s] after the start and after every gap, during which the count does not run either;
    residual : ``"absolute"``, or ``"printed"`` for Sections 5.2 and 5.3, which compare xi2 with its sign and so miss
    every fault that makes it negative.
    """

    consecutive: int = 2
    latch: bool = False
    settle_s: float = 0.0
    residual: Literal["absolute", "printed"] = "absolute"


@native
def threshold(phi: float, k2: float) -> float:
    """rho = abs(Phi) / k2, equation (4.27).

    That it gives no false alarm by construction is not true: it takes filtered abs(A) <= kappa abs(Phi), with
    kappa = (k2 + alpha1) / k2. Phi has to be calibrated on fault-free data.
    """
    return fabs(phi) / k2


@native
def exceeds(xi2: float, rho: float, form: float) -> bool:
    """Whether the residual is above the threshold; equality is not, so that 0 > 0 gives no alarm at rest."""
    return (xi2 if form == PRINTED else fabs(xi2)) > rho
