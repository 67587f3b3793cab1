"""What an engineer sees in recordings before any search: their motion, their load, and what a base model leaves of it.

Effects read their first guesses off it, see `Effect.first_guess`: linear regressions and sums over samples, no fits of
a model. A regression asks what a force explains of what is missing while the valve slides, beside whatever a change of
the base model explains as well.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recordings import Array

MOST_SAMPLES = 6000
"""Samples that a regression uses at most: enough for a guess."""
COLLINEAR = 1e-6
"""Share of the power of a force that a change of the base does not imitate, below which it is nothing of its own."""
BENT = 0.9
"""Share of its deflection when sliding from which a bristle is bent all the way."""
LEAST = 0.1
"""Share of a parameter of the base that is left to it, whatever an effect takes."""
HALF_WIDTHS = (0.04, 0.08, 0.15, 0.3)
"""Half widths of local effects, as shares of the travel."""
LINEAR = ("mass.m", "spring.K", "spring.F0", "lugre.fc", "lugre.fs", "lugre.sigma2")
"""Parameters of the base in which the force of a sliding valve is linear."""


@dataclass(frozen=True)
class FirstLook:
    """A recording at a first look, arrays (n,) at its samples. t time [s]; x, v, a position [m], velocity [m/s] and
    acceleration [m/s2] of the reading, smoothed; u force [N]; bent : deflection of the bristles as a share of that when
    sliding, with its sign; otherwise_bent (n, 2) : that of stiffer and of softer ones; moves : where the reading moves,
    whatever its noise does; held : known parameters of the base, by full name; pull : how strongly the measurements
    pull at a force on the stem, beside a fitted base, but for its sign and unit; None where none is fitted; by_chance
    (n, k) : how strongly noise alone would, k times.
    """

    t: Array
    x: Array
    v: Array
    a: Array
    u: Array
    bent: Array
    otherwise_bent: Array
    moves: NDArray[np.bool_]
    held: frozenset[str] = frozenset()
    pull: Array | None = None
    by_chance: Array | None = None

    @classmethod
    def of(
        cls, t: Array, motion: Array, u: Array, base: Mapping[str, float], held: Iterable[str] = (),
        pulls: Array | None = None,
    ) -> FirstLook:  # fmt: skip
        """From a motion (n, 3): smoothed x and v, and v behind a dead zone at the level of the noise. The bristles of a
        base model say how far they are bent, by the way that the reading has gone. pulls (n, 1 + k) : `pull` and
        `by_chance`.
        """
        x, v, crept = motion.T
        deflection = base["lugre.fs"] / base["lugre.sigma0"]
        bent, *others = (_bent(x, v, share * deflection) for share in (1.0, 0.5, 2.0))
        seen = t, x, v, np.gradient(v, t), u, bent, np.column_stack(others), crept != 0, frozenset(held)
        return cls(*seen) if pulls is None else cls(*seen, pulls[:, 0], pulls[:, 1:])

    @functools.cached_property
    def slides(self) -> NDArray[np.bool_]:
        """Where it moves and the bristles are bent all the way."""
        return np.asarray(self.moves & (self.bent * np.sign(self.v) > BENT))

    def falling(self, base: Mapping[str, float]) -> Array:
        """The share of Stribeck's fall of friction that is left at the speed of each sample."""
        return np.asarray(np.exp(-((self.v / base["lugre.vs"]) ** 2)))

    def friction(self, base: Mapping[str, float]) -> Array:
        """Friction by Stribeck's curve, without its viscous part [N]."""
        fc, fs = base["lugre.fc"], base["lugre.fs"]
        return np.asarray(self.bent * (fc + (fs - fc) * self.falling(base)))

    def by_base(self, base: Mapping[str, float], presliding: bool) -> dict[str, Array]:
        """What one more of each parameter in `LINEAR` that is not known adds to the force against the motion.

        presliding : and what stiffer and softer bristles add.
        """
        way, falling = self.bent, self.falling(base)
        forces = self.a, self.x, np.ones(len(self.t)), way * (1 - falling), way * falling, self.v
        found = {name: f for name, f in zip(LINEAR, forces, strict=True) if name not in self.held}
        if presliding:
            found |= {f"bristles {i}": other - way for i, other in enumerate(self.otherwise_bent.T)}
        return found

    def missing(self, base: Mapping[str, float]) -> Array:
        """What a base model lacks of the force against the motion, while the valve slides [N]."""
        linear = base["mass.m"] * self.a + base["spring.K"] * self.x + base["spring.F0"] + base["lugre.sigma2"] * self.v
        return np.asarray(self.u - linear - self.friction(base))

    def pulled(self, base: Mapping[str, float]) -> Array:
        """How strongly the measurements pull at a force (n,): without a fit, what is missing while the valve slides."""
        return np.where(self.slides, self.missing(base), 0.0) if self.pull is None else self.pull

    def thinned(self, every: int) -> FirstLook:
        """Every so-manieth sample."""
        names = ("t", "x", "v", "a", "u", "bent", "otherwise_bent", "moves", "pull", "by_chance")
        known = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        return replace(self, **{name: values[::every] for name, values in known.items()})


AddedForce = Callable[[FirstLook], Array]
"""What a unit of a strength adds to the force against the motion [N] (n,)."""
Trial = tuple[Mapping[str, float], Mapping[str, AddedForce]]
"""A shape of an effect, values by symbol, and the forces that its strengths have then, by symbol."""


@dataclass(frozen=True)
class Explained:
    """What forces explain. strengths (k,) of the forces; share : of what is missing beside a change of the base; base :
    the values of the base beside them, by full name.
    """

    strengths: list[float]
    share: float
    base: Mapping[str, float]


@dataclass(frozen=True)
class Guess:
    """A guess. values : of the effect, by symbol; base : of the base model beside it, by full name; share : of what is
    missing that it explains.
    """

    values: dict[str, float]
    base: Mapping[str, float]
    share: float


@dataclass(frozen=True)
class Missing:
    """What is missing while the valve slides. looks, base : of which recordings and model; columns (n, m) : what
    changes of the base add; force (n,) [N]; names (m,) of the parameters that are changed; presliding : of `of`.
    """

    looks: Sequence[FirstLook]
    base: Mapping[str, float]
    names: tuple[str, ...]
    columns: Array
    force: Array
    presliding: bool = False

    @classmethod
    def of(cls, looks: Sequence[FirstLook], base: Mapping[str, float], presliding: bool = False) -> Missing:
        """From some recordings and the values of a base model. presliding : also while the bristles bend."""
        some = [look.thinned(1 + sum(len(one.t) for one in looks) // MOST_SAMPLES) for look in looks]
        names = tuple(some[0].by_base(base, presliding))
        columns = [
            np.column_stack([*look.by_base(base, presliding).values()])[_mask(look, presliding)] for look in some
        ]
        force = [look.missing(base)[_mask(look, presliding)] for look in some]
        return cls(some, base, names, np.vstack(columns), np.concatenate(force), presliding)

    def explained(self, *forces: AddedForce) -> Explained | None:
        """What some forces explain; None where a change of the base does the same, and where nothing slides."""
        all_columns = np.column_stack([self.columns, *(self._masked(one) for one in forces)])
        scale = np.linalg.norm(all_columns, axis=0)
        if len(all_columns) <= all_columns.shape[1] or not (scale[-len(forces) :] > 0).all():
            return None
        scale[scale == 0] = 1.0
        scaled, m = all_columns / scale, len(self.names)
        gram, right = scaled.T @ scaled, scaled.T @ self.force
        beside = _solved(gram[:m, :m], np.column_stack([right[:m], gram[:m, m:]]))
        own = np.diag(gram[m:, m:] - gram[m:, :m] @ beside[:, 1:])
        left = float(self.force @ self.force - right[:m] @ beside[:, 0])
        if (own < COLLINEAR).any() or left <= 0:
            return None
        found = _solved(gram, right)
        share = 1.0 - float(self.force @ self.force - right @ found) / left
        found /= scale
        return Explained(found[m:].tolist(), share, self._changed(found[:m]))

    @functools.cached_property
    def _moves(self) -> Array:
        scale = np.linalg.norm(self.columns, axis=0)
        scale[scale == 0] = 1.0
        return np.asarray(np.linalg.lstsq(self.columns / scale, self.force, rcond=1e-10)[0] / scale)

    @property
    def unexplained(self) -> float:
        """Mean square of what no change of the base explains [N2]."""
        if not len(self.force):
            return 0.0
        return float(np.mean((self.force - self.columns @ self._moves) ** 2))

    @property
    def alone(self) -> Mapping[str, float]:
        """The base that explains most without any effect, by full name."""
        return self._changed(self._moves)

    def best(self, trials: Iterable[Trial]) -> Guess | None:
        """Of several shapes, with their strengths, the one that explains most; None where none explains anything."""
        found = [(shape, forces, self.explained(*forces.values())) for shape, forces in trials]
        known = [
            Guess({**shape, **dict(zip(forces, one.strengths, strict=True))}, one.base, one.share)
            for shape, forces, one in found if one is not None
        ]  # fmt: skip
        return max(known, key=lambda guess: guess.share, default=None)

    def _masked(self, force: AddedForce) -> Array:
        return np.concatenate([force(look)[_mask(look, self.presliding)] for look in self.looks])

    def _changed(self, moves: Array) -> dict[str, float]:
        """The base with some parameters changed, each as far as it may be."""
        found = dict(self.base)
        for name, move in ((n, m) for n, m in zip(self.names, moves, strict=True) if n in found):
            moved = found[name] + float(move)
            found[name] = moved if name == "spring.F0" else max(moved, LEAST * found[name])
        found["lugre.fs"] = max(found["lugre.fs"], found["lugre.fc"])
        return found


def travel(looks: Sequence[FirstLook]) -> tuple[float, float]:
    """Lowest and highest position [m]."""
    return min(float(look.x.min()) for look in looks), max(float(look.x.max()) for look in looks)


def along(looks: Sequence[FirstLook], n: int = 24) -> list[float]:
    """Places spread along the travel [m]."""
    low, high = travel(looks)
    return [float(x) for x in np.linspace(low, high, n + 2)[1:-1]]


def local_shapes(looks: Sequence[FirstLook]) -> list[tuple[float, float]]:
    """Places along the travel and half widths there, from a narrow spot to a good part of it [m]."""
    low, high = travel(looks)
    return [(x, share * (high - low)) for x in along(looks) for share in HALF_WIDTHS]


def stacked(drive: Array, reach: float, n: int) -> Array:
    """What n play elements carry of a drive (n_samples,), as a share of what all carry when they slip, times n: element
    i is taken along at the distance i reach/n, and they begin at the drive.
    """
    part = np.arange(1, n + 1)
    half, held = reach * part / n, np.full(n, drive[0])
    found = np.empty((len(drive), n))
    for i, value in enumerate(drive):
        held = np.minimum(np.maximum(held, value - half), value + half)
        found[i] = held
    return np.asarray(((drive[:, None] - found) / part).sum(axis=1) / reach)


def _bent(x: Array, v: Array, deflection: float) -> Array:
    """Deflection of bristles along a motion, as a share of that when sliding."""
    parts = np.exp(-np.abs(np.diff(x)) / deflection)
    bent, found = 0.0, [0.0]
    for way, part in zip(np.sign(v[1:]).tolist(), parts.tolist(), strict=True):
        bent = way + (bent - way) * part
        found.append(bent)
    return np.array(found)


def _mask(look: FirstLook, presliding: bool) -> NDArray[np.bool_]:
    return look.moves if presliding else look.slides


def _solved(matrix: Array, right: Array) -> Array:
    """The solution, shortest where there are several, of a system with ones on its diagonal."""
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-10)[0])
