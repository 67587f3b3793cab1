"""Static friction that rises with the time at rest, in both forms (equation 2.6, 2.7)."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter
from simulator.friction.separable import fit_separable


@dataclass(frozen=True)
class ExponentialDwell:
    """F_s(t) = ultimate - (ultimate - start) exp(-gamma t^m) (2.6), t the dwell time [s].

    ultimate : F_s,inf [N]; start : friction on arrival, F_c there [N]; gamma [1/s^m]; m : 1 is a plain exponential.
    Raises BadParameter for a force that is negative, and for gamma or m that is not positive.

    >>> ExponentialDwell(100.0, 60.0, gamma=0.5, m=0.5).force([0.0, 4.0]).round(3).tolist()
    [60.0, 85.285]
    """

    ultimate: float
    start: float
    gamma: float
    m: float

    shapes: ClassVar[tuple[tuple[float, float], ...]] = ((1e-3, 1e2), (0.1, 3.0))

    def __post_init__(self) -> None:
        _check(self.ultimate, self.start, gamma=self.gamma, m=self.m)

    @staticmethod
    def columns(t: Array, *shapes: float) -> Array:
        """What `ultimate` and `start` share of the force (n_samples, 2)."""
        left = np.exp(-shapes[0] * t ** shapes[1])
        return np.column_stack([1 - left, left])

    def force(self, dwell: ArrayLike) -> Array:
        """The break-away force [N] (n_samples) after dwell times [s] (n_samples)."""
        return _force(self, dwell)


@dataclass(frozen=True)
class RationalDwell:
    """F_s(t) = start + (ultimate - start) t/(t + gamma) (2.7), t the dwell time [s]; gamma [s], unlike that of (2.6).

    start : Stribeck friction at the end of the slip before [N], so that a rise goes on where the last slip left it.
    Raises BadParameter as `ExponentialDwell`.
    """

    ultimate: float
    start: float
    gamma: float

    shapes: ClassVar[tuple[tuple[float, float], ...]] = ((1e-3, 1e3),)

    def __post_init__(self) -> None:
        _check(self.ultimate, self.start, gamma=self.gamma)

    @staticmethod
    def columns(t: Array, *shapes: float) -> Array:
        """What `ultimate` and `start` share of the force (n_samples, 2)."""
        share = t / (t + shapes[0])
        return np.column_stack([share, 1 - share])

    def force(self, dwell: ArrayLike) -> Array:
        """The break-away force [N] (n_samples) after dwell times [s] (n_samples)."""
        return _force(self, dwell)


def fit_dwell(
    kind: type[ExponentialDwell] | type[RationalDwell], dwell: ArrayLike, force: ArrayLike
) -> tuple[ExponentialDwell | RationalDwell, float]:
    """The rise by least squares from break-away forces [N] after dwell times [s] (n_samples each), and its RMS error.

    Raises BadParameter for negative dwell times and rows that differ or are too short, BadInput where they do not tell
    a parameter.
    """
    t = np.asarray(dwell, dtype=float)
    if not (t >= 0).all():
        raise BadParameter("dwell", f"{t.min():g}", "it is negative", "give times at rest of 0 s or more")
    found = fit_separable(kind.columns, ("ultimate", "start"), kind.shapes, t, force)
    return kind(*(float(x) for x in (*found.linear, *found.shapes))), found.rmse


def _force(model: ExponentialDwell | RationalDwell, dwell: ArrayLike) -> Array:
    t = np.atleast_1d(np.asarray(dwell, dtype=float))
    if not (t >= 0).all():
        raise BadParameter("dwell", f"{t.min():g}", "it is negative", "give times at rest of 0 s or more")
    ultimate, start, *shapes = astuple(model)
    return model.columns(t, *shapes) @ np.array([ultimate, start])


def _check(ultimate: float, start: float, **shapes: float) -> None:
    for name, value in (("ultimate", ultimate), ("start", start)):
        if not 0 <= value < np.inf:
            raise BadParameter(name, f"{value:g}", "it is negative or not finite", "give 0 N or more")
    for name, value in shapes.items():
        if not 0 < value < np.inf:
            raise BadParameter(name, f"{value:g}", "it is not a positive number", "give more than 0")
