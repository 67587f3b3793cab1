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

CELLS = 16
"""Most cells along each side of the grid of the Preisach model."""
PER_MASS = 8
"""Fewest samples for each of its masses."""


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
    positive : names of those that may not be negative; slope : the one that is a spring to the motion, which is left
    out where spring.K is fitted: the two are one, and the motion does not tell them apart.
    """

    id: str
    text: str
    linear: tuple[tuple[str, str], ...]
    positive: tuple[str, ...] = ()
    slope = ""

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

    id, text, positive = "lugre", "LuGre (2.13-2.17)", ("fc", "sigma1", "sigma2")
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

    id, text, positive = "leuven", "Leuven integrated model (2.32-2.35)", ("fc", "sigma2")
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

    id, text = "maxwell-slip", "Maxwell slip, six elements (2.33)"
    linear = (*((f"f{i}", "N") for i in range(1, 7)), ("sigma2", "N s/m"))
    positive = tuple(name for name, _ in linear)

    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        return (ShapeRange("d", "m", *_lengths(path)),)

    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        parts = [MaxwellSlip([6 / (i * shapes[0])], [1.0], path.x[0]).follow(path.x) for i in range(1, 7)]
        return np.column_stack([*parts, path.v])


class BacklashLikeModel(FrictionModel):
    """A slope less backlash-like hysteresis (2.39), F = k x - w with c > B1: linear in k - c and c - B1.

    The output of (2.39) is late, and a friction leads: along its loop the force is higher on the way up. The memory of
    the start fades slowly, so c - B1 is in two shares: that of a start that had settled on the way up, and down.
    """

    id, text = "backlash-like", "slope less backlash-like hysteresis (2.39)"
    linear = (("k - c", "N/m"), ("c - B1 up", "N/m"), ("c - B1 down", "N/m"))
    positive, slope = ("c - B1 up", "c - B1 down"), "k - c"

    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        low, high = _lengths(path)
        return (ShapeRange("alpha", "1/m", 1 / high, 1 / low),)

    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        x, alpha = path.x.tolist(), float(shapes[0])
        loops = [SmoothBacklash(alpha, 1.0, 0.0, (x[0], x[0] + way / alpha)) for way in (-1, 1)]
        late = [[loop.update(value) for value in x] for loop in loops]
        return np.column_stack([path.x, *(path.x - np.array(row) for row in late)])


class PreisachModel(FrictionModel):
    """A slope less the classical Preisach model, F = k x - f (2.52-2.58), with a mass in every cell of an even grid.

    The output of (2.52) is late, and a friction leads. A slope less a play is a spring that slips, so Maxwell slip is
    the case in which a mass depends on alpha - beta alone.
    """

    id, text, slope = "preisach", "slope less Preisach, masses over a grid (2.52-2.58)", "k"

    def __init__(self, low: float = 0.0, high: float = 1.0, cells: int = CELLS) -> None:
        self._levels = np.linspace(low, high, cells + 1)
        self._cells = [(a, b) for a in range(cells) for b in range(a + 1)]
        self.linear = (("k", "N/m"), *((f"mu {a}.{b}", "N") for a, b in self._cells))
        self.positive = tuple(name for name, _ in self.linear)

    def bound(self, path: ImposedPath) -> FrictionModel:
        """With levels over the range of a motion, what goes beyond counts as the outermost; and with as many cells as
        leave `PER_MASS` samples for each mass.
        """
        cells = int((np.sqrt(1 + 8 * len(path.x) / PER_MASS) - 1) / 2)
        return PreisachModel(float(path.x.min()), float(path.x.max()), min(max(cells, 1), CELLS))

    def shapes(self, path: ImposedPath) -> tuple[ShapeRange, ...]:
        return ()

    def columns(self, path: ImposedPath, shapes: Array) -> Array:
        return np.column_stack([path.x, *(-self._cell(a, b).follow(path.x) for a, b in self._cells)])

    def _cell(self, a: int, b: int) -> Preisach:
        """The model of one unit mass, spread evenly over a cell: beta in cell b, alpha in cell a."""
        rows, columns = np.indices((len(self._levels), len(self._levels)))
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
