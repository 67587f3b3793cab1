"""What makes a fit impossible: a model or values that no valve has, and recordings that say too little."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import linprog

from identification.data.experiment import Experiment
from identification.estimators.coordinates import Coordinates, parameters
from identification.estimators.fitted import Outcome
from identification.estimators.output_error.starting_values import regression
from recordings import Array, BadParameter
from simulator import BASE, Catalogue, Kernel

FEWEST = 3
"""Samples per free parameter below which no fit is tried."""
REAL_TRAVEL = 10.0
"""Way, in standard deviations of the noise, from which a position counts as moved."""


def check_effects(effects: Sequence[str], catalogue: Catalogue) -> None:
    """Raise BadParameter for an effect that is not in the catalogue, or effects without those of the base."""
    for effect in effects:
        if effect not in catalogue:
            raise BadParameter("effects", effect, "there is no such effect", f"there are {', '.join(catalogue.ids)}")
    missing = [effect for effect in BASE if effect not in effects]
    if missing:
        remedy = f"add {', '.join(missing)}, and hold what the plant has not: spring.K=0 for no spring"
        raise BadParameter("effects", ", ".join(effects), f"a fit is of {', '.join(BASE)} at least", remedy)


def check_given(given: Mapping[str, float], valve: Kernel) -> None:
    """Raise BadParameter for a held parameter that the valve has not, or that no valve can have."""
    known = parameters(valve)
    for name, value in given.items():
        if name not in known:
            raise BadParameter("given", name, "no such parameter", f"there are {', '.join(known)}")
        if not known[name].allows(value):
            raise BadParameter("given", name, f"no valve has {value:g}", f"it is {known[name].bounds}")


def check_priors(priors: Mapping[str, tuple[float, float]], valve: Kernel) -> None:
    """Raise BadParameter for a prior of a parameter that the valve has not, or one that says nothing."""
    known = parameters(valve)
    for name, (mean, std) in priors.items():
        if name not in known:
            raise BadParameter("priors", name, "no such parameter", f"there are {', '.join(known)}")
        if not known[name].allows(mean):
            raise BadParameter("priors", name, f"no valve has {mean:g}", f"it is {known[name].bounds}")
        if not 0 < std < np.inf:
            raise BadParameter("priors", name, f"{std:g} is no standard deviation", "give a positive number")


def check_constraints(texts: Sequence[str], coordinates: Coordinates) -> None:
    """Raise BadParameter for constraints that no values keep, those that are held among them."""
    limits = coordinates.bounds
    if not len(limits.least):
        return
    ends = list(zip(limits.lower, limits.upper, strict=True))
    finite = np.isfinite(limits.least).all()
    if not finite or not linprog(np.zeros(coordinates.n_free), -limits.rows, -limits.least, bounds=ends).success:
        remedy = "loosen one of them, or what is given"
        raise BadParameter("constraints", ", ".join(texts), "no values keep them", remedy)


def obstacle(experiments: Sequence[Experiment], coordinates: Coordinates, force: Array) -> Outcome | None:
    """What makes a fit impossible before it starts, if anything."""
    if np.ptp(force) == 0.0:
        return Outcome.CONSTANT_INPUT
    if sum(e.samples for e in experiments) < FEWEST * coordinates.free.sum():
        return Outcome.TOO_SHORT
    up, down = _travel(experiments)
    still = all(np.ptp(s.y) == 0.0 for e in experiments for s in e.segments)
    if still or max(up, down) < REAL_TRAVEL or regression(experiments) is None:
        return Outcome.NO_MOTION
    return Outcome.NO_FRICTION if min(up, down) < REAL_TRAVEL and coordinates.is_free("spring.F0") else None


def _travel(experiments: Sequence[Experiment]) -> tuple[float, float]:
    """The longest way up and the longest way down in one segment, in standard deviations of the position's noise."""
    steps = [s.motion.crept[:-1] * np.diff(s.t) / e.noise_position for e in experiments for s in e.segments]
    return max(float(d[d > 0].sum()) for d in steps), max(float(-d[d < 0].sum()) for d in steps)
