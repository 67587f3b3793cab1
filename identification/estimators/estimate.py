"""What an estimator of paths and parameters answers, whatever it is: `NoiseAware` or `ImposedMotion`."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, replace

import numpy as np

from identification.estimators.least_squares import Normal, cauchy, weighted
from recordings import Array

TUNING = 3.0
"""Tuning of the Cauchy loss on normalised innovations, in sigmas."""
UNIT_LOSS = 0.8741
"""Expectation of that loss for a unit normal innovation."""
OUTLIER = 4.0
"""Sigmas from which an innovation is an outlier."""
CLEAN_LOSS, CLEAN_OUTLIERS = 1.03, 5e-4
"""Mean loss and share of outliers, and three standard deviations of each, up to which the innovations are those of the
right model."""
ROUGH_LOSS, ROUGH_OUTLIERS = 1.2, 1e-3
"""The same where the sampling does not resolve break-away, so that what its linearisation leaves is not noise. Where
more lies far off, paths are wrong in places, and parameters by more than their intervals say."""
HOPELESS = 50.0
"""Mean loss from which a fit follows nothing of the data."""


@dataclass(frozen=True)
class Totals:
    """Sums over the innovations of one grid. normal : their normal equations with Cauchy's weights at `TUNING` sigmas,
    and the loss of those by which an estimate is compared; logs : of their variances, summed; loss_y : loss of the
    positions alone; positions : their number; far : number of those beyond `OUTLIER` sigmas.
    """

    normal: Normal
    logs: float
    loss_y: float
    positions: int
    far: int


@dataclass(frozen=True)
class Innovations:
    """What the measurements of one grid say against their predictions.

    innovations, variances (n, 2) : of the position [m] and the force [N], variance inf where nothing was measured;
    by (n, 2, m) : their derivatives by the free coordinates, empty where they are not kept; scored : innovations and
    variances by which an estimate is compared; smoother : what the way back along a filtered path needs
    (`linearised_model.correction`), empty where there is none or it is not kept; totals : their sums, where they came
    along with them; library : compiled code that goes the way back, if any.
    """

    innovations: Array
    variances: Array
    by: Array
    scored: tuple[Array, Array]
    smoother: tuple[Array, ...] = ()
    totals: Totals | None = None
    library: ctypes.CDLL | None = None


def costs(innovations: Array, variances: Array, tuning: float = TUNING) -> Array:
    """Robust loss plus log variance of the innovations of every node (n,), from innovations and variances (n, 2)."""
    seen = np.isfinite(variances)
    known = np.where(seen, variances, 1.0)
    loss = cauchy(np.where(seen, innovations, 0.0) / np.sqrt(known), tuning)
    return np.asarray((loss + np.log(known)).sum(axis=1), float)


def totals(line: Innovations) -> Totals:
    """The sums over some innovations."""
    seen = np.isfinite(line.variances)
    sigma = np.sqrt(line.variances[seen])
    normal = weighted(line.innovations[seen] / sigma, line.by[seen] / sigma[:, None], TUNING)
    innovations, variances = line.scored
    y = innovations[seen[:, 0], 0] / np.sqrt(variances[seen[:, 0], 0])
    loss = float(cauchy(innovations[seen] / np.sqrt(variances[seen]), TUNING).sum())
    logs = float(np.sum(np.log(variances[seen])))
    loss_y, far = float(cauchy(y, TUNING).sum()), int(np.sum(np.abs(y) > OUTLIER))
    return Totals(replace(normal, cost=loss), logs, loss_y, len(y), far)


@dataclass(frozen=True)
class Estimate:
    """Parameters and paths at one step of a fit.

    theta (m,) : coordinates of the free parameters; paths : the states at the nodes, (n, n_states) for every grid
    (where the motion is imposed its position, velocity, the predicted force and nothing); linearised : the innovations
    of every grid; normal : their normal equations with the priors; cost : robust loss plus logarithms of the variances;
    loss : mean loss of an innovation of the position, 1 for a complete model; outliers : share of those beyond
    `OUTLIER` sigmas; settled : whether the descent has; tuning : of the loss, inf for squares.
    """

    theta: Array
    paths: tuple[Array, ...]
    linearised: tuple[Innovations, ...]
    normal: Normal
    cost: float
    loss: float
    outliers: float
    settled: bool = False
    tuning: float = TUNING

    @property
    def samples(self) -> int:
        """Number of samples whose prediction is counted in `loss`."""
        return sum(int(np.isfinite(line.variances[:, 0]).sum()) for line in self.linearised)

    @property
    def unexplained(self) -> float:
        """How much lower the cost would be if the position's innovations were noise; below 0 where chance made them
        less.
        """
        return (self.loss - 1.0) * self.samples * UNIT_LOSS

    @property
    def covariance(self) -> Array:
        """Covariance (m, m) of theta: the Cramer-Rao bound of the linearised model."""
        return np.asarray(np.linalg.pinv(self.normal.matrix), float)


def lean(estimate: Estimate) -> Estimate:
    """The estimate without what only a further step needs, which is most of its memory."""
    nothing = np.empty((0, 2, 0))
    lines = tuple(replace(line, by=nothing, smoother=()) for line in estimate.linearised)
    return replace(estimate, linearised=lines)


def handed_over(estimate: Estimate | None) -> list[Estimate]:
    """An estimate in a list, for a descent to take out; none without one. Whoever keeps a start by name keeps its
    matrices as well, a kilobyte or more a node, until the descent has ended.
    """
    return [] if estimate is None else [estimate]


def converged(estimate: Estimate, *, resolved: bool = True) -> bool:
    """Whether the innovations look like noise. resolved : break-away is, by the sampling."""
    loss, outliers = (CLEAN_LOSS, CLEAN_OUTLIERS) if resolved else (ROUGH_LOSS, ROUGH_OUTLIERS)
    return bool(
        estimate.loss < loss + 3 / np.sqrt(estimate.samples)
        and estimate.outliers < but_for_chance(outliers, estimate.samples)
    )  # fmt: skip


def but_for_chance(outliers: float, samples: int) -> float:
    """The share of outliers that so many samples may have where it is `outliers`: three standard deviations more."""
    return outliers + 3 * float(np.sqrt(outliers / samples))
