"""Profile likelihood: how the error grows when one parameter is held off its best value and all others follow.

Where the least-squares cost is not a parabola (a parameter near a bound, two that trade off) the profile says what the
standard deviation cannot (Raue et al., Bioinformatics 25(15), 2009).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Estimate
from identification.estimators.fitted import Fit
from identification.estimators.least_squares import minimise
from identification.estimators.output_error.problem import Problem
from identification.uncertainty.covariance import Uncertainty
from recordings import Array, BadParameter

CHI2_90 = 2.7055
"""90 % quantile of the chi-square distribution with one degree of freedom."""
RESTING, STEPS = 4, 4
"""Steps of the paths alone, and then of a noise-aware fit, at each value, from the paths of the one before it."""
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
    """Profile one parameter of a fit, of any estimator.

    known : the uncertainty of the fit; name : the parameter, by full name; points : values on each side, up to `reach`
    standard deviations away.
    Raises BadParameter for a name that is not a free parameter of the fit.
    """
    if name not in known.names:
        free = f"there are {', '.join(known.names)}"
        raise BadParameter("profile", name, "it is no free parameter of this fit", free)
    assert fit.minimum is not None
    place = known.names.index(name)
    width = known.spread[name] / fit.coordinates.slope(fit.p)[place]
    valley = Valley.of(fit)
    scale = width**2 / float(np.linalg.pinv(valley.matrix)[place, place])
    if fit.estimate is not None:  # the paths come to rest a little further at every value, so they do at the best one
        valley = valley.held_at(place, valley.unknowns[place]) or valley
    sides = []
    for sign in (-1.0, 1.0):
        here, side = valley, []
        for k in range(1, points + 1):
            found = here.held_at(place, valley.unknowns[place] + sign * reach * width * k / points)
            if found is None:
                break
            here = found
            side.append((_value(fit, name, here.unknowns), (here.cost - valley.cost) / scale))
            if side[-1][1] > STEEP:
                break
        sides.append(side)
    best = fit.values[name]
    table = np.array([*reversed(sides[0]), (best, 0.0), *sides[1]])
    values, rise = table[:, 0], table[:, 1] - np.min(table[:, 1])  # a refit can end below the fit
    at = int(np.argmin(rise))
    return Profile(name, values, rise, _crossing(values[at::-1], rise[at::-1]), _crossing(values[at:], rise[at:]))


def _value(fit: Fit, name: str, unknowns: Array) -> float:
    """The value of a parameter at some unknowns, less the bias that the values of the fit are less, too."""
    theta, c = unknowns[: fit.coordinates.n_free], fit.coordinates
    bias = 0.0 if fit.estimate is None else fit.estimate.theta - c.theta(fit.p)
    return c.values(theta - bias)[name]


@dataclass(frozen=True)
class Valley:
    """A place from which a profile goes on: unknowns (n,), the cost there, the Gauss-Newton matrix (n, n) of the best
    place, which knows how the valley runs, and of a noise-aware fit the estimate.
    """

    fit: Fit
    unknowns: Array
    cost: float
    matrix: Array
    estimate: Estimate | None = None

    @classmethod
    def of(cls, fit: Fit) -> Valley:
        """The best place of a fit."""
        assert fit.minimum is not None
        if fit.estimate is None:
            return cls(fit, fit.minimum.unknowns, fit.minimum.normal.cost, fit.minimum.normal.matrix)
        return cls(fit, fit.estimate.theta, fit.estimate.cost, fit.estimate.normal.matrix, fit.estimate)

    def held_at(self, place: int, theta: float) -> Valley | None:
        """The best place with one coordinate held at `theta`; None if it did not settle. The others start along the
        valley: from a place beside it, where two trade off, the fit would not find back.
        """
        others = np.delete(np.arange(len(self.unknowns)), place)
        along = -np.linalg.lstsq(self.matrix[np.ix_(others, others)], self.matrix[others, place], rcond=None)[0]
        moved = self.unknowns + (theta - self.unknowns[place]) * np.insert(along, place, 1.0)
        c = self.fit.coordinates
        name = c.free_names[place]
        held = c.holding({name: c.values(moved[: c.n_free])[name]})
        if self.estimate is not None:
            return self._noise_aware(held, place, theta, moved[others])
        assert self.fit.problem is not None
        assert self.fit.minimum is not None
        problem = Problem(self.fit.kernel, held, self.fit.problem.experiments)
        setting = self.fit.minimum.setting
        bounds = held.bounds.padded(len(others))
        end = minimise(lambda x: problem.evaluate(x, setting), moved[others], bounds=bounds, iterations=10)
        if end is None or not end.settled:
            return None
        return replace(self, unknowns=np.insert(end.theta, place, theta), cost=end.normal.cost)

    def _noise_aware(self, held: Coordinates, place: int, theta: float, others: Array) -> Valley | None:
        """The same along the paths of a noise-aware estimate."""
        assert self.estimate is not None
        assert self.fit.noise_aware is not None
        work = replace(self.fit.noise_aware, coordinates=held)
        first = work.along(others, self.estimate.paths, RESTING)
        end = None if first is None else work.descend(first, STEPS)
        if end is None:
            return None
        return replace(self, unknowns=np.insert(end.theta, place, theta), cost=end.cost, estimate=end)


def _crossing(values: Array, rise: Array) -> float | None:
    """Where a profile that starts at the best value first passes the 90 % limit, by interpolation."""
    above = np.flatnonzero(rise > CHI2_90)
    if not len(above):
        return None
    i = above[0]
    part = (np.sqrt(CHI2_90) - np.sqrt(rise[i - 1])) / (np.sqrt(rise[i]) - np.sqrt(rise[i - 1]))
    return float(values[i - 1] + part * (values[i] - values[i - 1]))
