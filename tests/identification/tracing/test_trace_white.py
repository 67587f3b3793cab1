"""Whether a model is complete where the sampling does not resolve the bristle: beside replicates of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm
from stiff_models import model_of
from stiff_valves import STIFF

from identification.data.grid import Grid
from identification.estimators.estimate import OUTLIER, TUNING, UNIT_LOSS, Estimate
from identification.estimators.least_squares import cauchy
from identification.tracing import settings
from identification.tracing.models.comparison import (
    LOSS_SPREAD,
    SQUARE_SPREAD,
    fitted_whiteness,
    held_out_whiteness,
    is_white,
    whiteness,
    whiteness_beside,
)


def test_losses_of_unit_noise_scatter_as_the_tests_assume():
    noise = np.random.default_rng(0).standard_normal(1_000_000)
    assert np.std(cauchy(noise, TUNING) / UNIT_LOSS) == pytest.approx(LOSS_SPREAD, rel=5e-3)
    assert np.std(noise**2) == pytest.approx(SQUARE_SPREAD, rel=5e-3)


@pytest.mark.parametrize(("share", "white"), [(0.9, True), (1.1, False)])
def test_a_mean_loss_is_held_against_that_scatter(share, white):
    most = float(norm.isf(settings.STRICT_LEVEL)) * LOSS_SPREAD / np.sqrt(400)
    assert (
        whiteness(SimpleNamespace(samples=400, loss=settings.COMPLETE_LOSS + share * most, outliers=0.0)).white == white
    )


def test_the_true_model_is_complete():
    model = model_of(STIFF)
    assert is_white(model)
    assert abs(fitted_whiteness(model).complete - settings.COMPLETE_LOSS) < 0.1


@pytest.mark.slow
def test_a_model_of_other_friction_is_not():
    model = model_of(STIFF | {"lugre.fc": 1.15 * STIFF["lugre.fc"], "lugre.fs": 1.15 * STIFF["lugre.fs"]})
    fitted, held_out = fitted_whiteness(model), held_out_whiteness(model)
    assert not fitted.white
    assert not held_out.white
    assert min(fitted.excess, held_out.excess) > 0


def test_nothing_is_complete_beside_which_no_replicate_has_a_solution():
    model = model_of(STIFF)
    assert not whiteness_beside(model.estimate, model.data.fitted, []).white


@pytest.mark.parametrize(("apart", "white"), [(1, True), (100, False)])
def test_one_slip_that_its_path_misses_is_chance_and_as_much_all_over_is_not(apart, white):
    model = model_of(STIFF)
    [line], grids = model.estimate.linearised, model.data.fitted
    innovations, variances = line.scored
    far = np.flatnonzero(np.isfinite(variances[:, 0]))[100 : 100 + 20 * apart : apart]
    harmed = innovations.copy()
    harmed[far, 0] = 1.2 * OUTLIER * np.sqrt(variances[far, 0])
    other = replace(model.estimate, linearised=[replace(line, scored=(harmed, variances))])
    assert whiteness_beside(other, grids, [(model.estimate, grids)]).white == white


@pytest.mark.parametrize("factor", [1.0, 1.15])
def test_replicates_are_only_made_until_one_says_enough(factor):
    model = model_of(STIFF | {name: factor * STIFF[name] for name in ("lugre.fc", "lugre.fs")})
    made = list[Estimate]()

    def replicates() -> Iterator[tuple[Estimate, tuple[Grid, ...]]]:
        for one in model.on_replicates(held_out=False):
            made.append(one[0])
            yield one

    assert whiteness_beside(model.estimate, model.data.fitted, replicates()).white == (factor == 1.0)
    assert len(made) == 1
