"""The pass in C answers what the parts do one after the other: innovations, smoother, and their sums."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from identification import experiment
from identification.data.grid import Grid, grids
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import Innovations, Totals, totals
from identification.estimators.noise_aware import linearised_model, recursions
from identification.estimators.noise_aware.linearised_model import (
    PathFreedom,
    correction,
    first_path,
    linearise,
    linearise_in_parts,
    smoothed,
)
from recordings import Array
from simulator import BASE, Excitation, Kernel, Sensors, kernel, random_valve, simulate

TRUTH, STROKE = random_valve(7)
FREEDOM = PathFreedom(h_max=5e-4)
BASE_PARAMETERS = kernel(BASE).parameters
EFFECTS = {
    "base": (),
    "delay": ("dead_time",),
    "plays": ("actuator_hysteresis", "backlash"),
    "sensor": ("sensor_lag", "sensor_nonlinearity"),
    "rates": ("dwell_stiction", "asymmetric_coulomb", "periodic_force"),
}
ADDED = {
    "dead_time.tau": 5e-3, "actuator_hysteresis.h": 20.0, "actuator_hysteresis.r": 50.0, "backlash.width": 2e-4,
    "sensor_lag.tau": 4e-3, "sensor_nonlinearity.q": 1e-3, "sensor_nonlinearity.c": 1e-3, "sensor_nonlinearity.L": 0.05,
    "dwell_stiction.a": 0.2, "dwell_stiction.gamma": 1.0, "dwell_stiction.d": 1e-5, "asymmetric_coulomb.a": 0.1,
    "periodic_force.a": 1.0, "periodic_force.b": 0.5, "periodic_force.f": 5.0,
}  # fmt: skip


@functools.cache
def grid(between: int = 1) -> Grid:
    sensors = Sensors(500.0, position_noise=2e-4 * STROKE, force_noise=1e-3 * TRUTH["spring.K"] * STROKE)
    recording, _ = simulate(TRUTH, Excitation.parse("mixed:6"), sensors, stroke=STROKE, seed=1)
    return grids([experiment(recording)])[0].divided(between)


Case = tuple[Kernel, Coordinates, Grid, Array, Array]


def case(model: Kernel, on: Grid, held: tuple[str, ...] = ()) -> Case:
    p = model.vector(TRUTH | ADDED)
    values = dict(zip(model.parameters, p.tolist(), strict=True))
    path = first_path(model, on, p)
    assert path is not None
    free = Coordinates.of(model, {name: values[name] for name in held}, float(np.nanstd(on.u)))
    return model, free, on, p, path


def with_error(*added: str, damped: bool = False) -> Kernel:
    return kernel((*BASE, *added), "force with error", damped=damped)


def assert_same(found: Innovations | None, expected: Innovations | None) -> None:
    assert found is not None
    assert expected is not None
    pairs = [
        (found.innovations, expected.innovations), (found.variances, expected.variances), (found.by, expected.by),
        *zip(found.scored, expected.scored, strict=True), *zip(found.smoother, expected.smoother, strict=True),
    ]  # fmt: skip
    for one, other in pairs:
        size = float(np.abs(other[np.isfinite(other)]).max(initial=0.0))
        assert_allclose(one, other, rtol=1e-10, atol=1e-10 * size)
    assert found.totals is not None
    assert_totals(found.totals, totals(expected))


def assert_totals(found: Totals, expected: Totals) -> None:
    assert (found.positions, found.far) == (expected.positions, expected.far)
    assert found.logs == pytest.approx(expected.logs, rel=1e-10)
    assert found.loss_y == pytest.approx(expected.loss_y, rel=1e-10)
    assert found.normal.cost == pytest.approx(expected.normal.cost, rel=1e-10)
    scale = np.sqrt(np.diag(expected.normal.matrix))
    assert_allclose(found.normal.matrix / np.outer(scale, scale), expected.normal.matrix / np.outer(scale, scale),
                    atol=1e-10)  # fmt: skip
    assert_allclose(found.normal.gradient / scale, expected.normal.gradient / scale, rtol=1e-10,
                    atol=1e-10 * np.sqrt(expected.normal.cost))  # fmt: skip


@pytest.mark.parametrize("damped", [False, True], ids=["midpoint", "damped"])
@pytest.mark.parametrize("added", EFFECTS.values(), ids=EFFECTS)
def test_it_answers_what_the_parts_do(added, damped):
    arguments = case(with_error(*added, damped=damped), grid())
    assert_same(linearise(*arguments, FREEDOM), linearise_in_parts(*arguments, FREEDOM))


@pytest.mark.parametrize(
    "held",
    [("mass.m",), ("spring.K", "lugre.sigma0"), BASE_PARAMETERS],
    ids=len,
)
def test_it_takes_derivatives_by_what_is_free(held):
    arguments = case(with_error("asymmetric_coulomb"), grid(), held)
    found = linearise(*arguments, FREEDOM)
    assert_same(found, linearise_in_parts(*arguments, FREEDOM))
    assert found.by.shape[2] == len(BASE_PARAMETERS) + 1 - len(held)


@pytest.mark.parametrize("passed", [linearise, linearise_in_parts])
def test_with_nothing_free_it_leads_to_the_same_path(passed):
    model, free, on, p, path = case(with_error("backlash", damped=True), grid())
    found, held = passed(model, free, on, p, path, FREEDOM), passed(model, free.all_held(), on, p, path, FREEDOM)
    assert held.by.shape == (*found.innovations.shape, 0)
    for one, other in zip((*held.scored, correction(held)), (*found.scored, correction(found)), strict=True):
        assert_allclose(one, other, rtol=1e-10, atol=1e-10 * np.abs(other[np.isfinite(other)]).max())


@pytest.mark.parametrize("added", EFFECTS.values(), ids=EFFECTS)
@pytest.mark.parametrize("share", [1.0, 0.6])
@pytest.mark.parametrize("moved", [False, True], ids=["left", "moved"])
def test_the_way_back_is_the_same(added, share, moved):
    line = linearise(*case(with_error(*added), grid(2)), FREEDOM)
    if line.library is None:
        pytest.skip("without a C compiler there is one way only")
    move = 1e-3 * np.random.default_rng(0).standard_normal(line.by.shape[2]) if moved else None
    found, expected = (smoothed(one, move, share, adjoints=True) for one in (line, replace(line, library=None)))
    for one, other in zip(found, expected, strict=True):
        size = np.maximum(np.abs(other).max(axis=0), 1e-12)
        assert_allclose(one / size, other / size, rtol=0, atol=1e-9)
    assert len(smoothed(line, move, share)[1]) == 0


def test_a_share_of_the_way_counts_where_the_parameters_stay():
    line = linearise(*case(with_error("backlash"), grid()), FREEDOM)
    move = 1e-3 * np.random.default_rng(0).standard_normal(line.by.shape[2])
    whole, stays = correction(line, move), correction(line)
    for share in (0.0, 0.6):
        expected = whole - (1 - share) * stays
        assert_allclose(correction(line, move, share), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_nothing_was_measured_at_nodes_between_samples():
    arguments = case(with_error(), grid(2))
    found = linearise(*arguments, FREEDOM)
    assert_same(found, linearise_in_parts(*arguments, FREEDOM))
    assert np.isinf(found.variances[1::2]).all()
    assert np.isfinite(found.variances[::2]).all()


@pytest.mark.parametrize("freedom", [replace(FREEDOM, honest=False), replace(FREEDOM, curvature=0.0),
                                     PathFreedom(3.0, 1e-2, 0.3, 1e-3), PathFreedom(h_max=2e-3)])  # fmt: skip
def test_it_gives_the_path_the_same_freedom(freedom):
    arguments = case(with_error(), grid())
    assert_same(linearise(*arguments, freedom), linearise_in_parts(*arguments, freedom))


@pytest.mark.parametrize("spoilt", [0, 1700, -1])
def test_a_path_on_which_the_model_fails_has_no_innovations(spoilt):
    *arguments, path = case(with_error(), grid())
    path[spoilt, 1] = np.nan
    assert linearise(*arguments, path, FREEDOM) is None
    assert linearise_in_parts(*arguments, path, FREEDOM) is None


def test_without_a_c_compiler_the_numbers_are_the_same(monkeypatch):
    compiled = linearise(*case(with_error(), grid()), FREEDOM)
    monkeypatch.setenv("BRISTLE_NO_COMPILER", "1")
    portable = case(with_error(), grid())
    assert not portable[0].scanner.compiled
    assert_same(compiled, linearise(*portable, FREEDOM))


def test_a_velocity_is_held_from_the_same_doubt_on():
    assert linearised_model.RUNAWAY == recursions.RUNAWAY
