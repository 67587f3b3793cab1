"""The least-squares driver against nonlinear regression problems with certified answers, and what else it promises.

NIST Statistical Reference Datasets, https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml: Misra1a (lower difficulty)
and Thurber (higher difficulty), each from both of its published starting points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from identification.estimators.least_squares import Normal, Solution, minimise, weighted

MISRA1A = (
    [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0],
    [10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78],
)
THURBER = (
    [-3.067, -2.981, -2.921, -2.912, -2.840, -2.797, -2.702, -2.699, -2.633, -2.481, -2.363, -2.322, -1.501, -1.460,
     -1.274, -1.212, -1.100, -1.046, -0.915, -0.714, -0.566, -0.545, -0.400, -0.309, -0.109, -0.103, 0.010, 0.119,
     0.377, 0.790, 0.963, 1.006, 1.115, 1.572, 1.841, 2.047, 2.200],
    [80.574, 84.248, 87.264, 87.195, 89.076, 89.608, 89.868, 90.101, 92.405, 95.854, 100.696, 101.060, 401.672, 390.724,
     567.534, 635.316, 733.054, 759.087, 894.206, 990.785, 1090.109, 1080.914, 1122.643, 1178.351, 1260.531, 1273.514,
     1288.339, 1327.543, 1353.863, 1414.509, 1425.208, 1421.384, 1442.962, 1464.350, 1468.705, 1447.894, 1457.628],
)  # fmt: skip


def misra1a(x: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """b1 (1 - exp(-b2 x)) and its derivatives by b."""
    decay = np.exp(-b[1] * x)
    return b[0] * (1 - decay), np.column_stack([1 - decay, b[0] * x * decay])


def thurber(x: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A ratio of cubics and its derivatives by b."""
    powers = np.column_stack([np.ones_like(x), x, x**2, x**3])
    above, below = powers @ b[:4], 1 + powers[:, 1:] @ b[4:]
    return above / below, np.column_stack([powers / below[:, None], -powers[:, 1:] * (above / below**2)[:, None]])


@dataclass(frozen=True)
class Certified:
    """A problem and what NIST certifies of it."""

    model: object
    data: tuple[list[float], list[float]]
    starts: tuple[list[float], list[float]]
    values: list[float]
    std: list[float]
    squares: float


PROBLEMS = {
    "Misra1a": Certified(
        misra1a, MISRA1A, ([500.0, 0.0001], [250.0, 0.0005]), [2.3894212918e02, 5.5015643181e-04],
        [2.7070075241e00, 7.2668688436e-06], 1.2455138894e-01,
    ),
    "Thurber": Certified(
        thurber, THURBER,
        ([1000.0, 1000.0, 400.0, 40.0, 0.7, 0.3, 0.03], [1300.0, 1500.0, 500.0, 75.0, 1.0, 0.4, 0.05]),
        [1.2881396800e03, 1.4910792535e03, 5.8323836877e02, 7.5416644291e01, 9.6629502864e-01, 3.9797285797e-01,
         4.9727297349e-02],
        [4.6647963344e00, 3.9571156086e01, 2.8698696102e01, 5.5675370270e00, 3.1333340687e-02, 1.4984928198e-02,
         6.5842344623e-03],
        5.6427082397e03,
    ),
}  # fmt: skip


def solved(problem: Certified, start: int) -> tuple[np.ndarray, Solution]:
    """Parameters, from coordinates that are logarithms as in a fit, and where the solution ended."""
    x, y = (np.array(column) for column in problem.data)

    def evaluate(theta: np.ndarray) -> Normal:
        b = np.exp(theta)
        predicted, by = problem.model(x, b)
        return weighted(predicted - y, by * b, np.inf)

    end = minimise(evaluate, np.log(problem.starts[start]), iterations=200, tolerance=1e-15)
    assert end is not None
    return np.exp(end.theta), end


def digits(found: np.ndarray, certified: list[float]) -> float:
    """Certified digits that are met by the worst number."""
    return float(-np.log10(np.max(np.abs(found / np.array(certified) - 1)) + 1e-16))


@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("name", PROBLEMS)
def test_certified_values_and_standard_errors_are_met(name, start):
    problem = PROBLEMS[name]
    b, end = solved(problem, start)
    free = len(problem.data[0]) - len(b)
    std = b * np.sqrt(np.diag(np.linalg.inv(end.normal.matrix)) * end.normal.cost / free)
    assert end.settled
    assert end.normal.cost == pytest.approx(problem.squares, rel=1e-9)
    assert digits(b, problem.values) > 6
    assert digits(std, problem.std) > 6


def quadratic(centre: np.ndarray, scale: np.ndarray):
    """Residuals (theta - centre) / scale."""
    return lambda theta: weighted((theta - centre) / scale, np.diag(1 / scale), np.inf)


def test_a_linear_problem_takes_one_move_whatever_its_scaling():
    centre, scale = np.array([0.3, -0.2, 0.1]), np.array([1e-3, 1.0, 1e3])
    end = minimise(quadratic(centre, scale), np.zeros(3), iterations=1, tolerance=0.0)
    assert end is not None
    assert np.allclose(end.theta, centre, rtol=1e-8)
    assert end.evaluations == 2


def test_no_coordinate_moves_further_than_allowed():
    seen = []

    def evaluate(theta):
        seen.append(theta.copy())
        return quadratic(np.array([50.0]), np.array([1.0]))(theta)

    minimise(evaluate, np.zeros(1), iterations=5, radius=0.5)
    assert np.all(np.abs(np.diff([s[0] for s in seen])) <= 0.5 + 1e-12)


def test_a_start_that_diverges_is_no_descent():
    assert minimise(lambda theta: None, np.zeros(2)) is None
    broken = Normal(1.0, np.zeros(2), np.full((2, 2), np.inf))
    assert minimise(lambda theta: broken, np.zeros(2)) is None
    assert minimise(lambda theta: Normal(np.nan, np.zeros(2), np.eye(2)), np.zeros(2)) is None


def test_a_place_that_diverges_is_backed_away_from():
    """Beyond 0.4 there is nothing, and the minimum is at 1: the solution stays on this side and never fails."""

    def evaluate(theta):
        return None if theta[0] > 0.4 else quadratic(np.array([1.0]), np.array([1.0]))(theta)

    end = minimise(evaluate, np.zeros(1), iterations=60)
    assert end is not None
    assert 0.2 < end.theta[0] <= 0.4


def test_the_robust_loss_is_not_drawn_by_outliers():
    rng = np.random.default_rng(1)
    x = rng.normal(2.0, 0.1, 200)
    x[:30] = 50.0

    def evaluate(tuning):
        return lambda theta: weighted((theta[0] - x) / 0.1, np.full((200, 1), 10.0), tuning)

    plain = minimise(evaluate(np.inf), np.array([2.5]), iterations=200, tolerance=1e-12)
    robust = minimise(evaluate(3.0), np.array([2.5]), iterations=200, tolerance=1e-12)
    assert plain is not None
    assert robust is not None
    assert plain.theta[0] == pytest.approx(np.mean(x), rel=1e-6)
    assert robust.theta[0] == pytest.approx(2.0, abs=0.03)


def test_a_prior_adds_to_cost_gradient_and_matrix():
    normal = weighted(np.array([1.0, 2.0]), np.eye(2), np.inf)
    held = normal.with_prior(np.array([1.0, 1.0]), np.array([0.0, 3.0]), np.array([4.0, 0.5]))
    assert held.cost == pytest.approx(5.0 + 4.0 + 0.5 * 4.0)
    assert np.allclose(held.gradient, [1.0 + 4.0, 2.0 - 1.0])
    assert np.allclose(held.matrix, np.diag([5.0, 1.5]))
