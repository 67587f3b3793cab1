"""The coordinates in which a fit moves: logarithms of positive parameters, scaled values of the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.estimators.constraints import Constraint, rows_of
from identification.estimators.least_squares import FeasibleSet, Normal
from recordings import Array
from simulator import Kernel, Parameter

FLOOR = 1e-7
"""A parameter that may be zero but moves in its logarithm stops at this fraction of its scale."""


@dataclass(frozen=True)
class Coordinates:
    """Which parameters are free, and the map between them and the coordinates theta (n_free,).

    names : all parameters in kernel order; base (n_parameters,) : values of the fixed ones; free, logs (n_parameters,)
    bool; scale (n_parameters,) : unit of the linear coordinates; lower, upper (n_parameters,) in physical units;
    priors : (name, mean, standard deviation) of what a user knows, SI units; constraints : that a user makes; learned :
    mean (n_free,) and precision (n_free, n_free) of theta by other recordings.
    """

    names: tuple[str, ...]
    base: Array
    free: NDArray[np.bool_]
    logs: NDArray[np.bool_]
    scale: Array
    lower: Array
    upper: Array
    priors: tuple[tuple[str, float, float], ...] = ()
    constraints: tuple[Constraint, ...] = ()
    learned: tuple[Array, Array] | None = None

    @classmethod
    def of(
        cls,
        kernel: Kernel,
        given: Mapping[str, float],
        force_scale: float,
        priors: Mapping[str, tuple[float, float]] | None = None,
    ) -> Coordinates:
        """Coordinates of a kernel's parameters with the `given` ones held; force_scale [N] scales a preload; priors :
        mean and standard deviation of what is known of some, by full name, SI units.
        """
        known = parameters(kernel)
        lower = np.array([p.lower for p in known.values()])
        base = np.array([given.get(name, p.scale) for name, p in known.items()])
        free = np.array([name not in given for name in known])
        logs = (lower >= 0) & np.array([p.neutral is None for p in known.values()])
        scale = np.array([force_scale if p.unit == "N" and p.lower < 0 else p.scale for p in known.values()])
        upper = np.array([p.upper for p in known.values()])
        told = tuple((name, *pair) for name, pair in (priors or {}).items() if name not in given)
        return cls(tuple(known), base, free, logs, scale, lower, upper, told)

    def below(self, bounds: Mapping[str, float]) -> Coordinates:
        """The same with upper bounds on some of the parameters, by full name in SI units, beside the physical ones."""
        told = np.array([bounds.get(name, np.inf) for name in self.names])
        return replace(self, upper=np.minimum(self.upper, told))

    @property
    def free_names(self) -> tuple[str, ...]:
        """Names of the free parameters, in the order of theta."""
        return tuple(name for name, free in zip(self.names, self.free, strict=True) if free)

    @property
    def defaults(self) -> dict[str, float]:
        """Values of the parameters by full name before any fit: those that are held, and the scales of the others."""
        return dict(zip(self.names, self.base.tolist(), strict=True))

    def held(self, name: str) -> float | None:
        """The value at which a parameter is held; None where it is free, or there is none of this name."""
        return None if self.is_free(name) else self.defaults.get(name)

    @property
    def n_free(self) -> int:
        """Number of free parameters."""
        return int(self.free.sum())

    def is_free(self, name: str) -> bool:
        """Whether there is a parameter of this full name, and it is free."""
        return name in self.names and bool(self.free[self.names.index(name)])

    def part(self, names: Sequence[str]) -> Coordinates:
        """The coordinates of some of the parameters, in their order here."""
        kept = np.isin(self.names, names)
        arrays = {key: getattr(self, key)[kept] for key in ("base", "free", "logs", "scale", "lower", "upper")}
        some = tuple(n for n, here in zip(self.names, kept, strict=True) if here)
        priors = tuple(one for one in self.priors if one[0] in some)
        own = tuple(one for one in self.constraints if set(one.names) <= set(some))
        return Coordinates(some, **arrays, priors=priors, constraints=own)

    def with_priors_at(self, theta: Array) -> Coordinates:
        """The same with the mean of every prior at what theta has."""
        values = self.values(theta)
        return replace(self, priors=tuple((name, values[name], std) for name, _, std in self.priors))

    def with_drawn_priors(self, theta: Array, rng: np.random.Generator) -> Coordinates:
        """The same with the mean of every prior drawn anew about what theta has: to a replicate a prior is one more
        measurement, with an error of its own.
        """
        at, least = self.with_priors_at(theta), dict(zip(self.names, self.lower.tolist(), strict=True))
        drawn = [(name, max(rng.normal(mean, std), least[name]), std) for name, mean, std in at.priors]
        return replace(at, priors=tuple(drawn))

    def values(self, theta: Array) -> dict[str, float]:
        """All parameters by name at coordinates theta."""
        return dict(zip(self.names, self.p(theta).tolist(), strict=True))

    def theta(self, p: Array) -> Array:
        """Coordinates of a parameter vector (n_parameters,)."""
        logarithm = np.log(np.maximum(p, FLOOR * self.scale))
        return np.where(self.logs, logarithm, p / self.scale)[self.free]

    def theta_of(self, values: Mapping[str, float]) -> Array:
        """Coordinates of parameter values by name, which may hold others, too."""
        return self.theta(np.array([values[name] for name in self.names]))

    def p(self, theta: Array) -> Array:
        """Parameter vector (n_parameters,) at coordinates theta; physical bounds are kept."""
        full = np.where(self.logs, np.log(np.maximum(self.base, FLOOR * self.scale)), self.base / self.scale)
        full[self.free] = theta
        with np.errstate(over="ignore"):
            moved = np.where(self.logs, np.exp(np.clip(full, -80.0, 80.0)), full * self.scale)
        return np.where(self.free, np.clip(moved, self.lower, self.upper), self.base)

    def holding(self, values: Mapping[str, float]) -> Coordinates:
        """The same with some of the free parameters held at values, by full name; what is held already stays so."""
        chosen = np.array([name in values for name in self.names]) & self.free
        base = np.where(chosen, [values.get(name, 0.0) for name in self.names], self.base)
        return replace(self, base=base, free=self.free & ~chosen)

    def all_held(self) -> Coordinates:
        """The same with no parameter free, for what asks for no derivatives by them."""
        return replace(self, free=np.zeros_like(self.free), learned=None)

    def told(self, theta: Array) -> Normal:
        """Normal equations (n_free,) of the user's priors, which are normal in the parameters themselves, and of what
        other recordings told.
        """
        p, n, names = self.p(theta), self.n_free, self.free_names
        mean, precision = self.learned or (theta, np.zeros((n, n)))
        off = theta - mean
        normal = Normal(float(off @ precision @ off), precision @ off, precision)
        for name, told, std in self.priors:
            away = (float(p[self.names.index(name)]) - told) / std
            by = np.zeros(n)
            by[names.index(name)] = self.slope(p)[names.index(name)] / std
            normal = normal.plus(Normal(away**2, away * by, np.outer(by, by)))
        return normal

    @property
    def bounds(self) -> FeasibleSet:
        """The physical bounds of the parameters as bounds of theta, and the user's constraints as its rows."""
        known = self.free
        least = np.log(FLOOR * self.scale)
        with np.errstate(divide="ignore", invalid="ignore"):
            lower = np.where(self.logs, np.fmax(np.log(self.lower), least), self.lower / self.scale)
            upper = np.where(self.logs, np.log(self.upper), self.upper / self.scale)
        rows = rows_of(self.constraints, self.names, self.base, self.logs, self.free, self.scale)
        return FeasibleSet(lower[known], upper[known], *rows)

    def slope(self, p: Array) -> Array:
        """dp/dtheta (n_free,) at a parameter vector."""
        return np.where(self.logs, p, self.scale)[self.free]


def parameters(kernel: Kernel) -> dict[str, Parameter]:
    """The parameters of a kernel by full name, in its order."""
    return kernel.catalogue.parameters(kernel.effects)
