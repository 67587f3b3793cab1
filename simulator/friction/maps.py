"""Friction as a function of velocity alone (equation 2.1-2.5, 2.11, 2.12), with least squares from measured maps."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import astuple, dataclass, fields, replace
from typing import ClassVar, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter
from simulator.friction.separable import fit_separable


@dataclass(frozen=True)
class FrictionMap(ABC):
    """F(v) [N] against the motion at v [m/s], 0 at standstill: linear in all parameters but the last, its `shapes`.

    shapes : least and largest value that a fit tries for each of them.
    """

    shapes: ClassVar[tuple[tuple[float, float], ...]] = ()

    @staticmethod
    @abstractmethod
    def columns(v: Array, *shapes: float) -> Array:
        """(n_samples, n_linear): the force of each linear parameter at 1, for velocities (n_samples)."""

    def force(self, velocity: ArrayLike) -> Array:
        """F (n_samples) [N] at velocities (n_samples) [m/s]."""
        values = astuple(self)
        n = len(values) - len(self.shapes)
        return self.columns(np.atleast_1d(np.asarray(velocity, dtype=float)), *values[n:]) @ np.array(values[:n])


@dataclass(frozen=True)
class CoulombMap(FrictionMap):
    """F = a sgn(v) (2.3)."""

    a: float

    @staticmethod
    def columns(v: Array, *shapes: float) -> Array:
        return np.sign(v)[:, None]


@dataclass(frozen=True)
class AsymmetricMap(FrictionMap):
    """F = a_i sgn(v) + b_i v (2.4), i = 1 for v > 0 and 2 for v < 0; a [N], b [N s/m]."""

    a1: float
    a2: float
    b1: float
    b2: float

    @staticmethod
    def columns(v: Array, *shapes: float) -> Array:
        up, down = v > 0, v < 0
        return np.column_stack([up, -1.0 * down, v * up, v * down])


@dataclass(frozen=True)
class StribeckMap(FrictionMap):
    """F = (a0 + a1 exp(-(b abs(v))^exponent)) sgn(v) + viscous v: (2.5) at exponent 1 and viscous 0, (2.17) at 2.

    a0 + a1 is the break-away force [N], b [s/m] the slip constant; viscous [N s/m].

    >>> StribeckMap(60.0, 40.0, 0.0, b=1000.0, exponent=1.0).force([1e-9, 1.0]).round(3).tolist()
    [100.0, 60.0]
    """

    a0: float
    a1: float
    viscous: float
    b: float
    exponent: float

    shapes: ClassVar[tuple[tuple[float, float], ...]] = ((1e-1, 1e5), (0.2, 5.0))

    @staticmethod
    def columns(v: Array, *shapes: float) -> Array:
        b, exponent = shapes
        return np.column_stack([np.sign(v), np.exp(-((b * np.abs(v)) ** exponent)) * np.sign(v), v])


@dataclass(frozen=True)
class CanudasMap(FrictionMap):
    """F = (a0 + a1 exp(-b1 abs(v)) + a2 (1 - exp(-b2 abs(v)))) sgn(v) (2.11); a [N], b [s/m].

    With asymmetric friction each direction has its own a: fit them apart.
    """

    a0: float
    a1: float
    a2: float
    b1: float
    b2: float

    shapes: ClassVar[tuple[tuple[float, float], ...]] = ((1e1, 1e5), (1e-2, 1e2))

    @staticmethod
    def columns(v: Array, *shapes: float) -> Array:
        b1, b2 = shapes
        speed = np.abs(v)
        return np.column_stack([np.ones_like(v), np.exp(-b1 * speed), -np.expm1(-b2 * speed)]) * np.sign(v)[:, None]


@dataclass(frozen=True)
class RootMap(FrictionMap):
    """F = (a0 + a1 sqrt(abs(v)) + a2 abs(v)) sgn(v) (2.12): linear in a0 [N], a1 [N sqrt(s/m)] and a2 [N s/m]."""

    a0: float
    a1: float
    a2: float

    @staticmethod
    def columns(v: Array, *shapes: float) -> Array:
        return np.column_stack([np.ones_like(v), np.sqrt(np.abs(v)), np.abs(v)]) * np.sign(v)[:, None]


AnyMap = TypeVar("AnyMap", bound=FrictionMap)


@dataclass(frozen=True)
class MapFit(Generic[AnyMap]):
    """The fitted map, the standard deviations of its parameters by name, its RMS error [N], and its columns."""

    map: AnyMap
    std: dict[str, float]
    rmse: float
    columns: Array

    def equivalent(self, difference: float) -> AnyMap:
        """Another map whose force differs from this one by an RMS of `difference` [N] at the samples, and whose linear
        parameters differ most: the samples cannot choose between the two once their noise is above that.
        """
        _, values, rows = np.linalg.svd(self.columns, full_matrices=False)
        away = rows[-1] * difference * np.sqrt(len(self.columns)) / values[-1]
        names = list(self.std)[: len(away)]
        return replace(
            self.map, **{name: getattr(self.map, name) + float(d) for name, d in zip(names, away, strict=True)}
        )


def fit_map(kind: type[AnyMap], velocity: ArrayLike, force: ArrayLike) -> MapFit[AnyMap]:
    """A map by least squares from measured velocity [m/s] and friction force [N] (n_samples each).

    Raises BadParameter for rows that differ or are too short, BadInput where the samples do not tell a parameter, as
    one direction alone for `AsymmetricMap`.

    >>> v = np.linspace(-0.1, 0.1, 41)
    >>> fit_map(AsymmetricMap, v, AsymmetricMap(50.0, 60.0, 100.0, 90.0).force(v)).map.a2.__round__(6)
    60.0
    """
    names = [field.name for field in fields(kind)]
    found = fit_separable(kind.columns, names[: len(names) - len(kind.shapes)], kind.shapes, velocity, force)
    values = [float(x) for x in (*found.linear, *found.shapes)]
    return MapFit(kind(*values), dict(zip(names, map(float, found.std), strict=True)), found.rmse, found.columns)


class TangentialStiffness(NamedTuple):
    """The spring of a contact before it slides: break-away force [N] and the deflection [m] at which it breaks away."""

    breakaway: float
    deflection: float

    @property
    def stiffness(self) -> float:
        """k_t = F_b / x_b [N/m] (2.2). Raises BadParameter for a force or deflection that is not positive."""
        for name, value in self._asdict().items():
            if not 0 < value < np.inf:
                raise BadParameter(name, f"{value:g}", "it is not a positive number", "give more than 0")
        return self.breakaway / self.deflection

    def force(self, displacement: ArrayLike) -> Array:
        """F_t = -k_t x [N] (2.1), the force on the body at displacements (n_samples) [m] from rest, up to break-away.

        Raises BadParameter for a displacement beyond it.
        """
        x = np.atleast_1d(np.asarray(displacement, dtype=float))
        if not (np.abs(x) <= self.deflection).all():
            raise BadParameter(
                "displacement", f"{np.abs(x).max():g}", "it has broken away", f"up to {self.deflection:g} m"
            )
        return -self.stiffness * x
