"""The order of the model that a recording can tell: one rule, from what the sampling resolves, before the fit.

The mass swings on its bristles at sqrt(sigma0/m), and slips on its spring at sqrt(K/m). What happens within a fraction
of the time between samples cannot be told from the samples:

- full: the swing on the bristles is resolved, and every parameter can show;
- damped: it is not; the bristles' swing is damped by an L-stable step instead of followed, and what it alone tells
  (bristle damping, often Stribeck velocity) stays unresolved. Where the course of a slip shows, the force can be
  estimated along with the motion; where a slip is a jump between two samples, mass often stays unresolved, too;
- static: not even the slip is; what is left is where the valve rests: spring, preload and the levels of friction.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from simulator import usual_damping

Order = Literal["full", "damped", "static"]

RESOLVED, RESOLVED_EXACT = 1.0, 12.0
"""Angle [rad] by which the mass swings on its bristles from sample to sample, up to which the swing is resolved where
the force is noisy, and where its samples are exact, so that only the integration has to follow."""
SLIP = 0.45
"""Angle [rad] by which the mass may swing on its spring in a sub-step of the damped order."""
SEEN = 2.0
"""Angle [rad] by which the mass swings on its spring from sample to sample, up to which the course of a slip is seen.
Beyond, a slip is a jump between two samples. What a controller makes of the force meanwhile cannot be known, and mass
and friction curve are estimated wrong by many standard deviations."""
LIGHTEST = 1.0
"""Mass [kg] that valves hardly fall short of."""
USUAL = 2.0
"""Mass [kg] of a usual valve: what a slip is taken for where none is resolved."""
LONGEST = 0.2
"""Time between samples [s] from which a slip is over before the next sample: nothing of it can be seen."""


def swing(values: Mapping[str, float]) -> float:
    """Angular frequency [rad/s] of the mass on its bristles, for parameters by full name."""
    return float(np.sqrt(values["lugre.sigma0"] / values["mass.m"]))


def turn(values: Mapping[str, float], spacing: float) -> float:
    """Angle [rad] by which the mass swings on its bristles in a time `spacing` [s], for parameters by full name."""
    return swing(values) * spacing


def at_rest(stiffness: float) -> dict[str, float]:
    """Values, by full name, of what the static order does not tell: a quick slip that ends where it balances, without
    overshoot, on a spring of a stiffness [N/m].
    """
    sigma0 = 1e7
    return {
        "mass.m": USUAL, "lugre.vs": 1e-3, "lugre.sigma0": sigma0, "lugre.sigma1": usual_damping(sigma0, USUAL),
        "lugre.sigma2": 2.0 * float(np.sqrt(max(stiffness, 1.0) * USUAL)),
    }  # fmt: skip


def order_of(values: Mapping[str, float], spacing: float, *, noisy: bool) -> Order:
    """The order for starting values by full name, samples `spacing` [s] apart and a force with or without noise."""
    if spacing > LONGEST:
        return "static"
    limit = RESOLVED if noisy else RESOLVED_EXACT
    return "full" if turn(values, spacing) < limit else "damped"


def slip(values: Mapping[str, float]) -> float:
    """Angular frequency [rad/s] of the mass on its spring, at which it slips, for parameters by full name."""
    return float(np.sqrt(max(values["spring.K"], 1.0) / values["mass.m"]))


def slip_is_seen(values: Mapping[str, float], spacing: float) -> bool:
    """Whether samples `spacing` [s] apart show the course of a slip, for parameters by full name."""
    return slip(values) * spacing < SEEN


def sub_step(values: Mapping[str, float], spacing: float) -> float:
    """The longest sub-step [s] of the damped order that resolves the slip, for samples `spacing` [s] apart.

    A slip of less than `LIGHTEST` whose course does not show is not resolved: mass is not to be told by it, and a model
    that lacks something may end at a hundredth of the valve's, in a hundred sub-steps a sample.
    """
    shown = max(SEEN / spacing, slip({**values, "mass.m": LIGHTEST}))
    return SLIP / min(slip(values), shown)


def slip_is_over(values: Mapping[str, float], spacing: float) -> bool:
    """Whether a slip, half a swing of the mass on its spring, is over before the next sample, `spacing` [s] later."""
    return slip(values) * spacing > np.pi


def swing_is_over(values: Mapping[str, float], spacing: float) -> bool:
    """Whether a whole swing of the mass on its spring is over before the next sample, `spacing` [s] later: of a slip
    samples show where it ended, and nothing else.
    """
    return slip(values) * spacing > 2 * np.pi
