"""Least squares in few unknowns by CasADi: Gauss-Newton steps that are quadratic programs, inside a trust region.

A Jacobian costs hardly more than a simulation here (forward sensitivities) and recordings are added up instead of
stacked, so an evaluation gives the normal equations of all residuals at once. They are a CasADi function whose oracle
is the compiled loop or the smoother's pass (`NormalEquations`); a step is solved by `casadi.conic`, with the bounds of
the coordinates as its bounds and physical constraints as its rows (Conn, Gould, Toint, Trust-Region Methods, 2000).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from identification.budget import time_is_over
from recordings import Array

REGULAR = 1e-10
"""Added to the diagonal of a whitened Gauss-Newton matrix, which may be singular."""
FAR = 1e9
"""Whitened units beyond which a bound is none: numbers of any size would spoil those beside them."""
MOST_FAILURES = 8
"""Steps in a row that do not lower the cost after which none will."""
POOR, GOOD = 0.25, 0.75
"""Shares of the predicted decrease below which the trust region shrinks, and above which it may grow."""


@dataclass(frozen=True)
class Normal:
    """cost : sum of losses; gradient (n,) : J^T W r; matrix (n, n) : J^T W J; of normalised residuals r."""

    cost: float
    gradient: Array
    matrix: Array

    def decrease(self, move: Array) -> float:
        """The fall of the cost that a move (n,) promises; negative where it promises a rise."""
        return -float(2 * self.gradient @ move + move @ self.matrix @ move)

    def plus(self, other: Normal) -> Normal:
        """The sum of both; the other may have only the first of the unknowns."""
        n, gradient, matrix = len(other.gradient), self.gradient.copy(), self.matrix.copy()
        gradient[:n] += other.gradient
        matrix[:n, :n] += other.matrix
        return Normal(self.cost + other.cost, gradient, matrix)

    def with_prior(self, theta: Array, centre: Array, precision: Array) -> Normal:
        """Add a normal prior of independent coordinates, precision (n,) = 1 / std^2."""
        off = theta - centre
        return Normal(
            self.cost + float(np.sum(precision * off**2)),
            self.gradient + precision * off,
            self.matrix + np.diag(precision),
        )


def weighted(r: Array, jacobian: Array, tuning: float) -> Normal:
    """Normal equations of residuals r (n_samples,) and jacobian (n_samples, n), Cauchy loss at `tuning` sigmas.

    An infinite tuning means plain squares.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isinf(tuning):
            return Normal(float(r @ r), jacobian.T @ r, jacobian.T @ jacobian)
        ratio = (r / tuning) ** 2
        heavy = jacobian / (1.0 + ratio)[:, None]
        return Normal(float(tuning**2 * np.sum(np.log1p(ratio))), heavy.T @ r, heavy.T @ jacobian)


def cauchy(r: Array, tuning: float) -> Array:
    """Cauchy's loss of each normalised innovation, of any shape; squares where the tuning is infinite."""
    return np.asarray(r**2 if np.isinf(tuning) else tuning**2 * np.log1p((r / tuning) ** 2), float)


@dataclass(frozen=True)
class FeasibleSet:
    """What the unknowns may be. lower, upper (n,); rows (k, n) with rows @ theta >= least (k,): linear constraints."""

    lower: Array
    upper: Array
    rows: Array = field(default_factory=lambda: np.zeros((0, 0)))
    least: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def none(cls, n: int) -> FeasibleSet:
        """No bounds on n unknowns."""
        return cls(np.full(n, -np.inf), np.full(n, np.inf))

    def nearest(self, theta: Array) -> Array:
        """The place (n,) nearest to theta that is allowed."""
        inside = np.clip(theta, self.lower, self.upper)
        if not len(self.least) or (self.rows @ inside >= self.least - 1e-9).all():
            return inside
        n = len(theta)
        found = _program(n, len(self.least))(
            h=np.eye(n), g=np.zeros(n), lbx=self.lower - inside, ubx=self.upper - inside,
            a=self.rows, lba=self.least - self.rows @ inside,
        )  # fmt: skip
        return np.asarray(inside + np.asarray(found["x"]).ravel(), float)

    def padded(self, n: int) -> FeasibleSet:
        """The same with unknowns behind that are free, n in all."""
        more = n - len(self.lower)
        rows = np.pad(self.rows.reshape(-1, len(self.lower)), ((0, 0), (0, more)))
        ends = np.full(more, np.inf)
        return FeasibleSet(np.concatenate([self.lower, -ends]), np.concatenate([self.upper, ends]), rows, self.least)


@dataclass(frozen=True)
class Step:
    """A step of the unknowns, (n,); decrease : of the cost, as the normal equations predict it; free : whether no side
    of the trust region stopped it, so that `decrease` is what is left to gain.
    """

    move: Array
    decrease: float
    free: bool


def gauss_newton(normal: Normal, theta: Array, radius: float, bounds: FeasibleSet) -> Step | None:
    """The best step by the normal equations that moves no unknown by more than `radius` and keeps the bounds.

    The unknowns are whitened by the diagonal. None where the quadratic program has no solution.
    """
    n, rows = len(theta), bounds.rows.reshape(-1, len(theta))
    diagonal = np.diag(normal.matrix)
    white = 1.0 / np.sqrt(np.maximum(diagonal, 1e-12 * max(float(diagonal.max()), 1e-300)))
    matrix = normal.matrix * np.outer(white, white)
    matrix[np.diag_indices(n)] += REGULAR
    gradient = normal.gradient * white
    lower = np.minimum(np.maximum(bounds.lower - theta, -radius), 0.0)
    upper = np.maximum(np.minimum(bounds.upper - theta, radius), 0.0)
    size = float(np.max(np.abs(gradient))) or 1.0
    found = _program(n, len(rows))(
        h=matrix / size, g=gradient / size, lbx=np.maximum(lower / white, -FAR), ubx=np.minimum(upper / white, FAR),
        a=rows * white, lba=np.minimum(bounds.least - rows @ theta, 0.0),
    )  # fmt: skip
    move = np.clip(np.asarray(found["x"]).ravel() * white, lower, upper)
    if not np.isfinite(move).all():
        return None
    return Step(move, max(normal.decrease(move), 0.0), bool(np.max(np.abs(move)) < 0.999 * radius))


@functools.lru_cache(maxsize=64)
def _program(n: int, rows: int) -> ca.Function:
    """The quadratic program of a step of n unknowns, by the dual active-set method DAQP: qrqp writes beyond its memory
    where it needs more than about a hundred changes of its active set, as with unknowns that hardly show.
    """
    shape = {"h": ca.Sparsity.dense(n, n), "a": ca.Sparsity.dense(rows, n)}
    return ca.conic("step", "daqp", shape, {"error_on_fail": False})


class NormalEquations(ca.Callback):
    """theta (n,) -> cost, gradient (n,) and Gauss-Newton matrix (n, n) as a CasADi function; NaN where it diverges."""

    def __init__(self, evaluate: Callable[[Array], Normal | None], n: int) -> None:
        ca.Callback.__init__(self)
        self._evaluate, self._n = evaluate, n
        self.construct("normal_equations", {})

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 3

    def get_sparsity_in(self, _: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._n)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(*((1, 1), (self._n, 1), (self._n, self._n))[i])

    def eval(self, arguments: Sequence[ca.DM]) -> list[ca.DM]:
        found = self._evaluate(np.asarray(arguments[0]).ravel())
        nothing = np.full((self._n, self._n), np.nan)
        found = Normal(np.nan, nothing[0], nothing) if found is None else found
        return [ca.DM(float(found.cost)), ca.DM(found.gradient), ca.DM(found.matrix)]

    def at(self, theta: Array) -> Normal | None:
        """The normal equations at theta; None where they are not finite: sensitivities can overflow where the model
        itself does not.
        """
        cost, gradient, matrix = (np.asarray(part) for part in self(theta))
        found = Normal(cost.item(), gradient.ravel(), matrix)
        finite = np.isfinite(found.cost) and np.isfinite(found.gradient).all() and np.isfinite(found.matrix).all()
        return found if finite else None


@dataclass(frozen=True)
class Solution:
    """Where a solver ended: theta (n,), the normal equations there, evaluations used; settled : by its first-order
    condition, what a further step would gain by the normal equations being below the tolerance, or because no step
    lowers the cost; left : that gain, in units of the cost.
    """

    theta: Array
    normal: Normal
    evaluations: int
    settled: bool
    left: float = 0.0


def minimise(
    evaluate: Callable[[Array], Normal | None],
    theta: Array,
    *,
    bounds: FeasibleSet | None = None,
    iterations: int = 30,
    tolerance: float = 1e-4,
    radius: float = 1.0,
) -> Solution | None:
    """Minimise a sum of losses from theta (n,).

    `evaluate` returns None where the model diverges; tolerance : decrease of the cost, relative to it, that a step has
    to promise or bring for the solver to go on; radius : largest move of a coordinate in one step.
    None when the start itself diverges.
    """
    function = NormalEquations(evaluate, len(theta))
    limits = FeasibleSet.none(len(theta)) if bounds is None else bounds
    theta = limits.nearest(theta)
    now, used, taken, reach, failures = function.at(theta), 1, 0, radius, 0
    if now is None:
        return None
    left = float("inf")
    for _ in range(iterations * (1 + MOST_FAILURES)):
        step = gauss_newton(now, theta, reach, limits)
        if step is None:
            return Solution(theta, now, used, False, left)
        enough = tolerance * max(now.cost, 1e-300)
        left = step.decrease if step.free else max(step.decrease, enough)
        if (step.free and step.decrease < enough) or failures > MOST_FAILURES:
            return Solution(theta, now, used, True, left)
        if taken >= iterations or time_is_over():
            return Solution(theta, now, used, False, left)
        trial = function.at(theta + step.move)
        used += 1
        if trial is None or trial.cost >= now.cost:
            reach, failures = float(np.max(np.abs(step.move))) / 4, failures + 1
            continue
        share = (now.cost - trial.cost) / max(step.decrease, 1e-300)
        if share < POOR:
            reach = float(np.max(np.abs(step.move))) / 2
        elif share > GOOD and not step.free:
            reach = min(2 * reach, radius)
        gained = now.cost - trial.cost
        theta, now, failures, taken = theta + step.move, trial, 0, taken + 1
        if gained < enough:
            return Solution(theta, now, used, True, left)
    return Solution(theta, now, used, True, left)
