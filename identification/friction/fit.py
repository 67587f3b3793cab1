"""A friction model by least squares of the force that a recorded motion takes: separable, from several starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.friction.models import FrictionModel, ImposedPath
from recordings import Array, BadInput

PLANT = (("mass.m", "kg"), ("spring.K", "N/m"), ("spring.F0", "N"))
"""What carries the friction in a valve: inertia, spring, force at position zero."""

_STARTS = 4
_EVALUATIONS = 60
_STILL = 1e-6
"""A motion of less than this share of the position is none."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of a recording without gaps: its motion, acceleration a [m/s2] and force u [N], (n_samples,), and which
    samples count.
    """

    path: ImposedPath
    a: Array
    u: Array
    counts: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class FrictionFit:
    """A fitted model: values by name, SI units, plant first; rmse : of the force, where it was fitted [N]."""

    model: FrictionModel
    plant: tuple[str, ...]
    shapes: Array
    linear: Array
    rmse: float

    @property
    def parameters(self) -> int:
        """How many were fitted."""
        return len(self.linear) + len(self.shapes)

    @property
    def values(self) -> dict[str, tuple[float, str]]:
        """Value and unit of every parameter by name; those of the friction begin with the model's id."""
        units = dict(PLANT)
        named = [(name, units[name]) for name in self.plant]
        named += [
            (f"{self.model.id}.{name}", unit)
            for (name, unit), fitted in zip(self.model.linear, _fitted(self.model, self.plant), strict=True)
            if fitted
        ]
        found = {name: (float(value), unit) for (name, unit), value in zip(named, self.linear, strict=True)}
        shapes = self.model.shapes(ImposedPath(np.zeros(2), np.zeros(2), np.zeros(2)))
        return found | {
            f"{self.model.id}.{one.name}": (float(x), one.unit) for one, x in zip(shapes, self.shapes, strict=True)
        }

    def force(self, stretch: Stretch) -> Array:
        """The force (n_samples,) [N] that the model says a motion takes."""
        return _columns(self.model, self.plant, stretch, self.shapes) @ self.linear


def fit_friction(model: FrictionModel, stretches: Sequence[Stretch], plant: tuple[str, ...]) -> FrictionFit:
    """Fit to stretches; plant : which of `PLANT` are fitted with it. Raises BadInput where the motion tells nothing."""
    from scipy.optimize import least_squares

    target = np.concatenate([one.u[one.counts] for one in stretches])
    if not len(target) or not any(_moves(one) for one in stretches):
        raise BadInput("friction", "nothing moves in the recording", "give a recording of a moving valve")
    longest = max(stretches, key=lambda one: float(np.ptp(one.path.x)))
    model = model.bound(longest.path)
    shapes = model.shapes(longest.path)

    def error(logs: Array) -> Array:
        return _solved(model, plant, stretches, np.exp(logs), target)[1]

    best = np.zeros(0)
    if shapes:
        low, high = np.log([one.low for one in shapes]), np.log([one.high for one in shapes])
        found = [
            least_squares(error, start, bounds=(low, high), x_scale=0.3, diff_step=1e-3, max_nfev=_EVALUATIONS)
            for start in _starts(error, low, high)
        ]
        best = np.exp(min(found, key=lambda one: one.cost).x)
    linear, residual = _solved(model, plant, stretches, best, target)
    return FrictionFit(model, plant, best, linear, float(np.sqrt(np.mean(residual**2))))


def _moves(one: Stretch) -> bool:
    return float(np.ptp(one.path.x)) > _STILL * float(np.abs(one.path.x).max())


def _starts(error, low: Array, high: Array) -> list[Array]:  # type: ignore[no-untyped-def]
    """The best two of points that fill the box evenly."""
    from scipy.stats import qmc

    points = qmc.scale(qmc.Sobol(len(low), scramble=False).random(2 ** (_STARTS + 1))[1:], low, high)
    costs = [float(np.sum(error(point) ** 2)) for point in points]
    return [points[i] for i in np.argsort(costs)[:2]]


def _solved(
    model: FrictionModel, plant: tuple[str, ...], stretches: Sequence[Stretch], shapes: Array, target: Array
) -> tuple[Array, Array]:
    """The linear parameters for given shapes, and the residual."""
    rows = np.concatenate([_columns(model, plant, one, shapes)[one.counts] for one in stretches])
    size = np.linalg.norm(rows, axis=0)
    size = np.where(size > 0, size, 1.0)
    fitted = _fitted(model, plant)
    signs = [name in model.positive for (name, _), kept in zip(model.linear, fitted, strict=True) if kept]
    linear = _least_squares(rows / size, target, np.array([False] * len(plant) + signs)) / size
    return linear, rows @ linear - target


def _least_squares(rows: Array, target: Array, positive: NDArray[np.bool_]) -> Array:
    """Coefficients, some of them not negative: these after the free ones are projected out."""
    from scipy.optimize import nnls

    found = np.zeros(rows.shape[1])
    free, bound = rows[:, ~positive], rows[:, positive]
    if bound.shape[1]:
        directions, sizes, _ = np.linalg.svd(free, full_matrices=False)
        q = directions[:, sizes > 1e-10 * sizes.max(initial=0.0)]
        found[positive] = nnls(bound - q @ (q.T @ bound), target - q @ (q.T @ target), maxiter=100 * len(found))[0]
    found[~positive] = np.linalg.lstsq(free, target - bound @ found[positive], rcond=1e-10)[0]
    return found


def _fitted(model: FrictionModel, plant: tuple[str, ...]) -> list[bool]:
    """Which linear parameters of a model are fitted: all, but for a slope beside the spring of the plant."""
    return [not (name == model.slope and "spring.K" in plant) for name, _ in model.linear]


def _columns(model: FrictionModel, plant: tuple[str, ...], one: Stretch, shapes: Array) -> Array:
    carried = {"mass.m": one.a, "spring.K": one.path.x, "spring.F0": np.ones(len(one.a))}
    own = model.columns(one.path, shapes)[:, _fitted(model, plant)]
    return np.column_stack([*(carried[name] for name in plant), own])
