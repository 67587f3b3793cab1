"""Profile likelihood: how the error grows when one parameter is held off its best value and all others follow.

Where the least-squares cost is not a parabola (a parameter near a bound, two that trade off) the profile says what the
standard deviation cannot (Raue et al., Bioinformatics 25(15), 2009).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.estimators.fitted import Fit
from identification.estimators.least_squares import minimise
from identification.estimators.output_error.problem import Problem
from identification.uncertainty.covariance import Uncertainty
from recordings import Array, BadParameter

CHI2_90 = 2.7055
"""90 % quantile of the chi-square distribution with one degree of freedom."""
STEEP = 10 * CHI2_90
"""A profile that has risen this far is not followed further."""


@dataclass(frozen=True)
class Profile:
    """How the cost rises beside the best value of one parameter.

    name : of the parameter; values (n_points,) : of it, SI units, ascending; rise (n_points,) : of the cost, in units
    of the residual variance, corrected for a residual that is not white; lower, upper : 90 % interval, None where no
    end of it was found: the profile stays below the limit, or the others cannot be refitted.
    """

    name: str
    values: Array
    rise: Array
    lower: float | None
    upper: float | None


def profile(fit: Fit, known: Uncertainty, name: str, points: int = 7, reach: float = 3.0) -> Profile:
    """Profile one parameter of a fit by output error or with an imposed motion.

    known : the uncertainty of the fit; name : the parameter, by full name; points : values on each side, up to `reach`
    standard deviations away.
    Raises BadParameter for a name that is not a free parameter of the fit, and for a noise-aware fit.
    """
    if name not in known.names:
        free = f"there are {', '.join(known.names)}"
        raise BadParameter("profile", name, "it is no free parameter of this fit", free)
    if fit.estimate is not None:
        why = "the fit is noise-aware, and its cost has no profile yet that would be cheap enough"
        remedy = "fit with the estimator output-error, or read the standard deviation"
        raise BadParameter("profile", name, why, remedy)
    assert fit.minimum is not None
    place = known.names.index(name)
    width = known.std[name] / fit.coordinates.slope(fit.p)[place]
    scale = max(fit.rms, 1e-12) ** 2 * max(known.inflation, 1.0) ** 2
    sides = []
    for sign in (-1.0, 1.0):
        unknowns, side = fit.minimum.unknowns, []
        for k in range(1, points + 1):
            found = _held_at(fit, place, fit.minimum.unknowns[place] + sign * reach * width * k / points, unknowns)
            if found is None:
                break
            cost, unknowns = found
            side.append((_value(fit, name, unknowns), (cost - fit.minimum.normal.cost) / scale))
            if side[-1][1] > STEEP:
                break
        sides.append(side)
    best = fit.values[name]
    table = np.array([*reversed(sides[0]), (best, 0.0), *sides[1]])
    values, rise = table[:, 0], np.maximum(table[:, 1], 0.0)
    at = len(sides[0])
    return Profile(name, values, rise, _crossing(values[at::-1], rise[at::-1]), _crossing(values[at:], rise[at:]))


def _value(fit: Fit, name: str, unknowns: Array) -> float:
    c = fit.coordinates
    return float(c.p(unknowns[: int(c.free.sum())])[c.names.index(name)])


def _held_at(fit: Fit, place: int, theta: float, unknowns: Array) -> tuple[float, Array] | None:
    """Cost with one coordinate held at `theta`, the others refitted, and all unknowns there; None if it did not settle.

    The refit starts from `unknowns` moved along the valley that the Gauss-Newton matrix knows: from a place beside it,
    where two parameters trade off, a descent would not find back.
    """
    assert fit.minimum is not None
    assert fit.problem is not None
    c, matrix = fit.coordinates, fit.minimum.normal.matrix
    others = np.delete(np.arange(len(unknowns)), place)
    along = -np.linalg.lstsq(matrix[np.ix_(others, others)], matrix[others, place], rcond=None)[0]
    moved = unknowns + (theta - unknowns[place]) * np.insert(along, place, 1.0)
    index = int(np.flatnonzero(c.free)[place])
    base, free = c.base.copy(), c.free.copy()
    base[index], free[index] = c.p(moved[: int(c.free.sum())])[index], False
    problem = Problem(fit.kernel, replace(c, base=base, free=free), fit.problem.experiments)
    setting = fit.minimum.setting
    bounds = fit.coordinates.bounds.padded(len(unknowns)).of(others)
    end = minimise(lambda x: problem.evaluate(x, setting), moved[others], bounds=bounds, iterations=10)
    if end is None or not end.settled:
        return None
    return end.normal.cost, np.insert(end.theta, place, theta)


def _crossing(values: Array, rise: Array) -> float | None:
    """Where a profile that starts at the best value first passes the 90 % limit, by interpolation."""
    above = np.flatnonzero(rise > CHI2_90)
    if not len(above):
        return None
    i = above[0]
    part = (np.sqrt(CHI2_90) - np.sqrt(rise[i - 1])) / (np.sqrt(rise[i]) - np.sqrt(rise[i - 1]))
    return float(values[i - 1] + part * (values[i] - values[i - 1]))
