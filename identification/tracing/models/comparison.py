"""Two models compared on the same recordings, and the test whether the innovations of one are noise."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, poisson, ttest_1samp
from scipy.stats import t as student

from identification.data.grid import Grid
from identification.estimators.estimate import OUTLIER, ROUGH_OUTLIERS, UNIT_LOSS, Estimate, Innovations, costs
from identification.estimators.imposed_motion.grid import BLOCK
from identification.estimators.least_squares import cauchy
from identification.estimators.noise_aware.search import UNEXPLAINED
from identification.tracing import settings
from identification.tracing.models.model import Model
from recordings import Array

LOSS_SPREAD = 1.264
"""Standard deviation of Cauchy's loss of one unit normal innovation, in means of it."""
SQUARE_SPREAD = 2.0**0.5
"""The same of its square."""
OnReplicates = Iterable[tuple[Estimate, tuple[Grid, ...]]]
"""Estimates of a model on replicates, which lack nothing, and their grids, as they are asked for."""


@dataclass(frozen=True)
class Comparison:
    """One model against another on the same grids. gain : fall of the cost; t : Student's t of it over blocks of time;
    p_value : one-sided; gain_elsewhere : fall of the cost without the few blocks where it is largest.
    """

    gain: float
    t: float
    p_value: float
    gain_elsewhere: float


def compare(before: Estimate, after: Estimate, grids: tuple[Grid, ...]) -> Comparison:
    """How much better the second estimate explains the position, block by block."""
    costs_of = [[costs(*line.scored, one.tuning) for line in one.linearised] for one in (before, after)]
    gains = _summed(grids, [was - now for was, now in zip(*costs_of, strict=True)])
    spread = float(np.std(gains, ddof=1)) or 1e-12
    value = float(np.mean(gains)) / (spread / np.sqrt(len(gains)))
    elsewhere = float(np.sort(gains)[: -settings.LEFT_OUT_BLOCKS].sum())
    return Comparison(float(gains.sum()), value, float(student.sf(value, len(gains) - 1)), elsewhere)


def _blocks(values: Array | NDArray[np.bool_], grid: Grid) -> Array:
    """Sums over blocks of time."""
    block = np.floor((grid.t - grid.t[0]) / BLOCK).astype(int)
    return np.asarray(np.bincount(block, values), float)


@dataclass(frozen=True)
class Whiteness:
    """Whether innovations are noise of the size that the recording has. white : they are; p_value : of that; loss :
    their mean loss; outliers : share of those that are far off; complete : loss of a complete model at most.
    """

    white: bool
    p_value: float
    loss: float
    outliers: float
    complete: float = field(default_factory=lambda: settings.COMPLETE_LOSS)

    @property
    def excess(self) -> float:
        """Loss above that of a complete model; negative where the model is complete."""
        return self.loss - self.complete


def whiteness(estimate: Estimate) -> Whiteness:
    """Test of the position's innovations: their mean loss, of independent samples if the model is complete, and their
    outliers.
    """
    spread = LOSS_SPREAD / np.sqrt(estimate.samples)
    p_value = float(norm.sf((estimate.loss - settings.COMPLETE_LOSS) / spread))
    if estimate.outliers > ROUGH_OUTLIERS:
        p_value = min(p_value, float(norm.sf(OUTLIER)))
    return Whiteness(p_value > settings.STRICT_LEVEL, p_value, estimate.loss, estimate.outliers)


def whiteness_beside(estimate: Estimate, grids: tuple[Grid, ...], replicates: OnReplicates) -> Whiteness:
    """Test of the position's innovations where the sampling does not resolve break-away: its linearisation leaves more
    than noise of a complete model, too, most of it in a few places. So the loss over blocks of time is compared with
    that of the same blocks of replicates, which lack nothing (paired t test). Without any, nothing is white, and nor is
    what leaves more innovations far off than they do, or than a fit that has converged may (`_by_chance_so_many_far`).

    Each replicate takes seconds, so one comes after the other, until the model leaves no more than they do, or is
    rejected: after each of them at an equal share of the level, so that the level holds for all together.
    """
    found, known = Whiteness(False, 0.0, estimate.loss, estimate.outliers), list[Estimate]()
    counted = _summed(grids, [np.isfinite(line.scored[1][:, 0]) for line in estimate.linearised])
    left, own = list[Array](), _position_loss(estimate, grids)
    for one, some in replicates:
        known.append(one)
        left.append(_position_loss(one, some))
        allowed = np.mean(left, axis=0) + (settings.COMPLETE_LOSS - 1) * counted
        p_value = float(ttest_1samp(own - allowed, 0.0, alternative="greater").pvalue)
        far = max(ROUGH_OUTLIERS, float(np.mean([one.outliers for one in known])))
        p_value = min(p_value, _by_chance_so_many_far(estimate, grids, far))
        p_value, complete = min(1.0, settings.REPLICATES * p_value), float(allowed.sum() / counted.sum())
        white = p_value > settings.STRICT_LEVEL
        found = Whiteness(white, p_value, estimate.loss, estimate.outliers, complete)
        if not white or found.excess <= 0:
            break
    return found


def _by_chance_so_many_far(estimate: Estimate, grids: tuple[Grid, ...], share: float) -> float:
    """The probability of at least as many innovations far off where a share of them is. They come in bursts: one slip
    that its path misses leaves ten or twenty. So the blocks of time that have any are counted (compound Poisson).
    """
    far = _summed(grids, [np.abs(_normal(line)) > OUTLIER for line in estimate.linearised])
    bursts = int(np.count_nonzero(far))
    return float(poisson.sf(bursts - 1, share * estimate.samples * bursts / far.sum())) if bursts else 1.0


def _normal(line: Innovations) -> Array:
    """The position's innovations in their standard deviations (n,), 0 where none is seen."""
    innovations, variances = (z[:, 0] for z in line.scored)
    seen = np.isfinite(variances)
    return np.asarray(np.where(seen, innovations, 0.0) / np.sqrt(np.where(seen, variances, 1.0)), float)


def _position_loss(estimate: Estimate, grids: tuple[Grid, ...]) -> Array:
    """The loss of the position's innovations over blocks of time, 1 for each of a complete model."""
    found = [cauchy(_normal(line), estimate.tuning) / UNIT_LOSS for line in estimate.linearised]
    return _summed(grids, found)


def _summed(grids: tuple[Grid, ...], values: Sequence[Array | NDArray[np.bool_]]) -> Array:
    """Sums over blocks of time of what is known at the nodes of some grids (n,) each."""
    return np.concatenate([_blocks(z, grid) for z, grid in zip(values, grids, strict=True)])


def imposed_whiteness(estimate: Estimate, grids: tuple[Grid, ...]) -> Whiteness:
    """Test of the errors of a predicted force: their mean square over blocks of time. Errors of the motion are large
    where a valve slips, and memory keeps them, so neither samples nor outliers tell more than the blocks do.

    A few blocks hardly know their own spread. That of a complete model is at most the square root of 2, where all
    errors of a block are one; so a mean that is too large for this counts as well (two tests, each at half the level).
    """
    excess, counted = list[Array](), list[Array]()
    for line, grid in zip(estimate.linearised, grids, strict=True):
        counts = np.isfinite(line.variances[:, 0])
        square = np.where(counts, line.innovations[:, 0] ** 2 / line.variances[:, 0], 0.0)
        excess.append(_blocks(square - settings.COMPLETE_LOSS * counts, grid))
        counted.append(_blocks(counts, grid))
    sums, weights = np.concatenate(excess), np.concatenate(counted)
    by_spread = float(ttest_1samp(sums, 0.0, alternative="greater").pvalue)
    by_size = float(norm.sf(sums.sum() / (SQUARE_SPREAD * np.sqrt(np.sum(weights**2)))))
    p_value = min(1.0, 2 * float(np.fmin(by_spread, by_size)))
    return Whiteness(p_value >= settings.STRICT_LEVEL, p_value, estimate.loss, estimate.outliers)


def fitted_whiteness(model: Model) -> Whiteness:
    """The test on the fitted grids."""
    return _whiteness_of(model, model.estimate, model.data.fitted, model.on_replicates(held_out=False))


def held_out_whiteness(model: Model) -> Whiteness:
    """The test on the held-out grids; failed where the model has no solution on them."""
    as_fitted = _held_out_whiteness(model, model.held_out)
    if as_fitted.white or not fitted_whiteness(model).white:  # what misses its own data does not know its error
        return as_fitted
    return _held_out_whiteness(model, model.held_out_within_error)


def _held_out_whiteness(model: Model, estimate: Estimate | None) -> Whiteness:
    """The test of an estimate of a model on the held-out grids; failed where there is none."""
    if estimate is None:
        return Whiteness(False, 0.0, float("inf"), 1.0)
    return _whiteness_of(model, estimate, model.data.held_out, model.on_replicates(held_out=True))


def _whiteness_of(
    model: Model, estimate: Estimate, grids: tuple[Grid, ...], replicates: OnReplicates
) -> Whiteness:  # fmt: skip
    """The test of an estimate of a model that suits its data. replicates : the model on them, each of which takes
    seconds: a complete model does not leave less there than noise, so what does not leave more than that passes.
    """
    if model.data.imposed:
        return imposed_whiteness(estimate, grids)
    plain = whiteness(estimate)
    clear = estimate.loss <= 1.0 if plain.white else estimate.loss > UNEXPLAINED
    if model.data.damped is None or clear:
        return plain
    return whiteness_beside(estimate, grids, replicates)


def is_white(model: Model) -> bool:
    """Whether nothing but noise is in the innovations, on fitted and held-out grids. Where the held-out grids hold more
    than what the error of the parameters may explain, that is not tried.
    """
    if not fitted_whiteness(model).white:
        return False
    as_fitted = _held_out_whiteness(model, model.held_out)
    return as_fitted.white or (model.error_may_explain(as_fitted.excess) and held_out_whiteness(model).white)


def whiteness_of_all(model: Model) -> Whiteness | None:
    """The test on the held-out grids of a predicted force where one further fit to all grids leaves nothing but noise
    on the fitted and on the held-out ones; None elsewhere. Noise of the motion moves parameters by more than the error
    that the fit gives them, so what the fit misses on the held-out grids may be that alone.
    """
    one = model.fitted_to_all if model.data.imposed and fitted_whiteness(model).white else None
    return held_out_whiteness(one) if one is not None and is_white(one) else None
