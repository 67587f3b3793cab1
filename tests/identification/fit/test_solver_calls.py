"""Every parameter step of the house is a quadratic program that CasADi solves: counted in each kind of fit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import casadi as ca
import numpy as np
import pytest
from seeded_valves import recorded
from stiff_valves import STIFF, stem_test
from traced_valves import imposed

from identification import experiment, fit, trace
from identification.estimators import least_squares
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import FeasibleSet, Normal, gauss_newton, minimise, weighted
from identification.estimators.output_error.starting_values import starting_values
from simulator import BASE, CATALOGUE, Catalogue, kernel, random_valve


@contextmanager
def programs() -> Iterator[list[int]]:
    """The numbers of unknowns of all quadratic programs that are solved inside."""
    solved: list[int] = []
    make = least_squares._program

    def counting(n: int, rows: int) -> Callable[..., dict[str, ca.DM]]:
        program = make(n, rows)
        assert isinstance(program, ca.Function)

        def solve(**arguments: object) -> dict[str, ca.DM]:
            solved.append(n)
            return program(**arguments)

        return solve

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(least_squares, "_program", counting)
        yield solved


def held(seed: int, *free: str) -> dict[str, float]:
    """All parameters of a seeded valve but those that stay free."""
    return {name: value for name, value in random_valve(seed)[0].items() if name not in free}


SOFT = {"lugre.sigma0": 1e5, "lugre.sigma1": 300.0}


def start() -> None:
    valve, experiments = kernel(BASE), [experiment(recorded(2, "sine:4", 250.0))]
    force = float(np.std(experiments[0].segments[0].u))
    assert starting_values(experiments, valve, Coordinates.of(valve, {}, force))


def damped() -> None:
    free = {"spring.K", "lugre.fc", "lugre.fs"}
    given = {name: value for name, value in STIFF.items() if name not in free}
    found = fit([experiment(r) for r in stem_test(50.0, ("sine:20",))], given=given)
    assert found.order == "damped"
    assert found.outcome.usable


def output_error() -> None:
    found = fit([experiment(recorded(2, "sine:4", 250.0))], given=held(2, "spring.K", "lugre.fc"))
    assert (found.order, found.estimator) == ("full", "output-error")
    assert found.outcome.usable


def noise_aware() -> None:
    given = {name: value for name, value in (STIFF | SOFT).items() if name not in ("spring.K", "lugre.fc")}
    [short] = stem_test(250.0, ("sine:4",), values=SOFT)
    found = fit([experiment(short)], given=given, estimator="noise-aware")
    assert found.estimate is not None


def imposed_motion() -> None:
    found = fit([experiment(imposed(recorded(2, "sine:4", 250.0)))], given=held(2, "spring.K", "lugre.fc"))
    assert found.kernel.causality == "motion"
    assert found.outcome.usable


def traced() -> None:
    few = Catalogue(tuple(CATALOGUE[name] for name in (*BASE, "hardening_spring")))
    rig = imposed(recorded(2, "sine:8", 250.0))
    assert trace([rig], given=held(2, "spring.K", "lugre.fc"), catalogue=few).base.fit.outcome.usable


@pytest.mark.parametrize(
    ("work", "steps"),
    [(start, 12), (damped, 20), (output_error, 5), (noise_aware, 5), (imposed_motion, 3), (traced, 10)],
)
def test_every_kind_of_fit_takes_its_steps_by_quadratic_programs(work, steps):
    with programs() as solved:
        work()
    assert len(solved) >= steps


def test_without_a_solver_nothing_moves(monkeypatch: pytest.MonkeyPatch):
    """No fit has another way: where programs have no solution, it stays at its start."""
    nothing = {"x": ca.DM.nan(2)}
    monkeypatch.setattr(least_squares, "_program", lambda n, rows: lambda **_: nothing)
    end = minimise(lambda theta: weighted(theta - 1.0, np.eye(2), np.inf), np.zeros(2))
    assert end is not None
    assert end.theta.tolist() == [0.0, 0.0]
    assert not end.settled


def bowl(centre: list[float], matrix: list[list[float]]) -> Normal:
    """The normal equations at zero of a parabola with its lowest place at `centre`."""
    h, c = np.array(matrix), np.array(centre)
    return Normal(float(c @ h @ c), -h @ c, h)


def test_a_step_keeps_bounds_rows_and_radius_and_is_the_best_of_those():
    normal = bowl([2.0, 1.0], [[2.0, 0.6], [0.6, 1.0]])
    upper = FeasibleSet(np.full(2, -np.inf), np.array([0.5, np.inf]))
    free = gauss_newton(normal, np.zeros(2), 10.0, FeasibleSet.none(2))
    bounded = gauss_newton(normal, np.zeros(2), 10.0, upper)
    short = gauss_newton(normal, np.zeros(2), 0.25, FeasibleSet.none(2))
    row = FeasibleSet(np.full(2, -np.inf), np.full(2, np.inf), np.array([[-1.0, -1.0]]), np.array([-1.0]))
    cut = gauss_newton(normal, np.zeros(2), 10.0, row)
    assert free is not None
    assert free.free
    assert free.move == pytest.approx([2.0, 1.0], rel=1e-6)
    assert free.decrease == pytest.approx(normal.cost, rel=1e-6)
    # beside a bound x = 0.5 the best y is 1 + 0.6 (2 - 0.5) = 1.9
    assert bounded is not None
    assert bounded.move == pytest.approx([0.5, 1.9], rel=1e-6)
    assert short is not None
    assert not short.free
    assert short.move == pytest.approx([0.25, 0.25], rel=1e-6)
    # on x + y = 1: the multiplier is (2 + 1 - 1) / (1 1) H^-1 (1 1)^T = 2 / (1.8 / 1.64)
    inverse = np.linalg.inv(normal.matrix)
    expected = np.array([2.0, 1.0]) - inverse @ np.ones(2) * 2.0 / (np.ones(2) @ inverse @ np.ones(2))
    assert cut is not None
    assert cut.move == pytest.approx(expected, rel=1e-5)
    assert cut.decrease < free.decrease


def test_a_minimum_outside_is_found_at_the_bound_and_no_place_beyond_is_asked_for():
    seen: list[np.ndarray] = []

    def evaluate(theta: np.ndarray) -> Normal:
        """Rosenbrock's valley, its lowest place at (1, 1)."""
        seen.append(theta.copy())
        x, y = theta
        return weighted(np.array([1 - x, 10 * (y - x**2)]), np.array([[-1.0, 0.0], [-20 * x, 10.0]]), np.inf)

    bounds = FeasibleSet(np.array([-2.0, -2.0]), np.array([0.6, 2.0]))
    end = minimise(evaluate, np.array([-1.2, 1.0]), bounds=bounds, iterations=100, tolerance=1e-10)
    assert end is not None
    assert end.settled
    assert end.theta == pytest.approx([0.6, 0.36], abs=1e-4)
    assert all((theta <= bounds.upper + 1e-12).all() and (theta >= bounds.lower - 1e-12).all() for theta in seen)


def test_what_is_left_to_gain_tells_an_end_from_a_stop():
    def evaluate(theta: np.ndarray) -> Normal:
        return weighted(np.exp(theta) - 5.0, np.diag(np.exp(theta)), np.inf)

    stopped = minimise(evaluate, np.array([-3.0]), iterations=2, tolerance=1e-6)
    ended = minimise(evaluate, np.array([-3.0]), iterations=60, tolerance=1e-6)
    assert stopped is not None
    assert ended is not None
    assert not stopped.settled
    assert stopped.left > 1e-3
    assert ended.settled
    assert ended.left < 1e-6
    assert ended.theta[0] == pytest.approx(np.log(5.0), rel=1e-3)
