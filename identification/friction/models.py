"""Friction models that can be fitted to a recorded motion and force: the models of `simulator`, and what is free.

A model says which of its parameters enter linearly. The others, its shapes, are searched; for given shapes the linear
ones are the least squares. The definition is the one that simulates.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from recordings import Array
from simulator.backlash import SmoothBacklash
from simulator.friction import (
    AsymmetricMap,
    CanudasMap,
    CoulombMap,
    FrictionMap,
    LeuvenFriction,
    LuGreParameters,
    RootMap,
    StribeckMap,
)
from simulator.hysteresis import Everett, MaxwellSlip, Preisach


@dataclass(frozen=True)
class ImposedPath:
    """A motion along which a friction force is wanted: time t [s], position x [m], velocity v [m/s], (n_samples,)."""

    t: Array
    x: Array
    v: Array


@dataclass(frozen=True)
class ShapeRange:
    """A parameter that is searched, on a logarithmic scale between two positive bounds; unit : SI."""

    name: str
    unit: str
    low: float
    high: float


class FrictionModel(ABC):
    """A friction model along an imposed motion, as columns that the linear parameters multiply.

    id : what it is called; text : in words, with its equation; linear : names and units of the linear parameters;
    positive : whether none of these may be negative.
    """

    id: str
    text: str
    linear: tuple[tuple[str, str], ...]
    positive = False

    def bound(self, path: ImposedPath) -> FrictionModel:
        """The model with what a motion fixes once for all, as the levels of a grid."""
        return self

    @abstractmethod
    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        """What is searched, bounded by what the motion can show."""

    @abstractmethod
    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        """The force (n_samples, n_linear) [N] of each linear parameter at 1."""


class MapModel(FrictionModel):
    """A force that depends on the velocity alone; at rest it says nothing."""

    def __init__(self, id: str, text: str, kind: type[FrictionMap], linear: str, shapes: str = "") -> None:
        self.id, self.text, self._kind = id, text, kind
        self.linear = tuple((name, unit) for name, _, unit in (one.partition(":") for one in linear.split()))
        self._names = tuple((name, unit) for name, _, unit in (one.partition(":") for one in shapes.split()))

    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        return tuple(
            ShapeRange(name, unit, low, high)
            for (name, unit), (low, high) in zip(self._names, self._kind.shapes, strict=True)
        )

    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        return self._kind.columns(path.v, *shapes)


def _velocities(path: ImposedPath) -> tuple[float, float]:
    fastest = float(np.quantile(np.abs(path.v), 0.99)) + 1e-12
    return 1e-3 * fastest, 2.0 * fastest


def _lengths(path: ImposedPath) -> tuple[float, float]:
    travel = float(np.ptp(path.x)) + 1e-15
    return 1e-3 * travel, 2.0 * travel


class LuGreModel(FrictionModel):
    """LuGre (2.13-2.17) for unit friction: its deflection fc/sigma0 and its Stribeck curve are searched."""

    id, text, positive = "lugre", "LuGre (2.13-2.17)", True
    linear = (("fc", "N"), ("sigma1", "N s/m"), ("sigma2", "N s/m"))

    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        return (
            ShapeRange("z0", "m", *_lengths(path)),
            ShapeRange("fs/fc", "1", 0.2, 5.0),
            ShapeRange("vs", "m/s", *_velocities(path)),
        )

    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        z0, ratio, vs = shapes
        unit = {"sigma0": 1 / z0, "fc": 1.0, "fs": ratio, "vs": vs}
        elastic = LuGreParameters(sigma1=0.0, sigma2=0.0, **unit).follow(path.t, path.x)
        damped = LuGreParameters(sigma1=1.0, sigma2=0.0, **unit).follow(path.t, path.x)
        return np.column_stack([elastic, damped - elastic, path.v])


class LeuvenModel(FrictionModel):
    """The Leuven model (2.32-2.35) of a straight F_d(z), whose transition bends by n."""

    id, text, positive = "leuven", "Leuven integrated model (2.32-2.35)", True
    linear = (("fc", "N"), ("sigma2", "N s/m"))

    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        return (
            ShapeRange("z0", "m", *_lengths(path)), ShapeRange("n", "1", 0.3, 3.0), ShapeRange("fs/fc", "1", 0.5, 3.0),
            ShapeRange("vs", "m/s", *_velocities(path)),
        )  # fmt: skip

    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        z0, n, ratio, vs = shapes
        friction = LeuvenFriction(lambda z: z / z0, lambda v: 1 + (ratio - 1) * np.exp(-((v / vs) ** 2)), n)
        return np.column_stack([friction.follow(path.t, path.x), path.v])


class MaxwellModel(FrictionModel):
    """Maxwell slip: elements that slip at even shares of a searched deflection, each with a friction of its own."""

    id, text, positive = "maxwell-slip", "Maxwell slip, six elements (2.33)", True
    linear = (*((f"f{i}", "N") for i in range(1, 7)), ("sigma2", "N s/m"))

    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        return (ShapeRange("d", "m", *_lengths(path)),)

    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        parts = [MaxwellSlip([6 / (i * shapes[0])], [1.0], path.x[0]).follow(path.x) for i in range(1, 7)]
        return np.column_stack([*parts, path.v])


class BacklashLikeModel(FrictionModel):
    """Backlash-like hysteresis (2.39): linear in c, B1 and its first value."""

    id, text = "backlash-like", "backlash-like hysteresis (2.39)"
    linear = (("c", "N/m"), ("c - B1", "N/m"), ("ahead", "N"))

    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        low, high = _lengths(path)
        return (ShapeRange("alpha", "1/m", 1 / high, 1 / low),)

    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path.x)))])
        loop = SmoothBacklash(float(shapes[0]), 1.0, 0.0, (float(path.x[0]), float(path.x[0])))
        hysteresis = np.array([loop.update(float(x)) for x in path.x]) - path.x
        return np.column_stack([path.x, hysteresis, np.exp(-shapes[0] * travelled)])


class PreisachModel(FrictionModel):
    """The classical Preisach model (2.52-2.58) over an even grid of levels, with a mass in every cell of its plane."""

    id, text, positive = "preisach", "Preisach, masses over a grid of eight levels (2.52-2.58)", True
    linear = tuple((f"mu {a}.{b}", "N") for a in range(8) for b in range(a + 1))

    def __init__(self, levels: Array | None = None) -> None:
        self._levels = np.linspace(0.0, 1.0, 9) if levels is None else levels

    def bound(self, path: ImposedPath) -> FrictionModel:
        """With levels over the range of a motion; what goes beyond counts as the outermost."""
        return PreisachModel(np.linspace(path.x.min(), path.x.max(), 9))

    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        return ()

    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        return np.column_stack([self._cell(a, b).follow(path.x) for a in range(8) for b in range(a + 1)])

    def _cell(self, a: int, b: int) -> Preisach:
        """The model of one unit mass, spread evenly over a cell: beta in cell b, alpha in cell a."""
        rows, columns = np.indices((9, 9))
        values = ((rows > a) & (columns <= b) & (columns < rows)).astype(float)
        return Preisach(Everett(self._levels, values), float(self._levels[0]), float(self._levels[-1]))


MODELS: dict[str, FrictionModel] = {
    one.id: one
    for one in (
        MapModel("coulomb", "Coulomb (2.3)", CoulombMap, "a:N"),
        MapModel("asymmetric", "asymmetric Coulomb and viscous (2.4)", AsymmetricMap, "a1:N a2:N b1:Ns/m b2:Ns/m"),
        MapModel("stribeck", "Stribeck curve with exponent (2.5)", StribeckMap, "a0:N a1:N viscous:Ns/m",
                 "b:s/m exponent:1"),
        MapModel("canudas", "exponentials of the speed (2.11)", CanudasMap, "a0:N a1:N a2:N", "b1:s/m b2:s/m"),
        MapModel("root", "linear in its parameters (2.12)", RootMap, "a0:N a1:N(s/m)^0.5 a2:Ns/m"),
        LuGreModel(),
        LeuvenModel(),
        MaxwellModel(),
        BacklashLikeModel(),
        PreisachModel(),
    )
}  # fmt: skip
"""All that can be compared, by id."""
