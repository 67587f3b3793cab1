"""Everett's function F(alpha, beta) of (2.54), learned from measured first-order reversal curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from recordings import Array, BadParameter
from simulator.hysteresis.reversal_curves import ReversalCurve, tabulated

Negative = Literal["keep", "refuse", "remove"]


class Everett:
    """F(alpha, beta) by values at a grid of levels, linear between them: no differentiation of measured curves.

    levels (n) : inputs, rising; values (n, n) : F at alpha = level i, beta = level j <= i, zero at j = i; the others
    are not read; middle : the output halfway between both saturations. Call it for F; `weights` are its masses.
    Raises BadParameter for levels that do not rise and values that are not finite or not zero at alpha = beta.

    >>> even = Everett([0.0, 1.0, 2.0], [[0, 0, 0], [0.5, 0, 0], [2.0, 0.5, 0]])
    >>> even(2.0, 1.0), even(2.0, 0.5), even(1.5, 1.0)
    (0.5, 1.25, 0.25)
    """

    def __init__(self, levels: ArrayLike, values: ArrayLike, middle: float = 0.0) -> None:
        u, F = np.array(levels, dtype=float), np.array(values, dtype=float)
        if u.ndim != 1 or len(u) < 2 or not (np.diff(u) > 0).all():
            raise BadParameter("levels", u.shape, "they do not rise", "give two or more rising inputs")
        if F.shape != (len(u), len(u)) or not np.isfinite(np.tril(F)).all():
            raise BadParameter("values", F.shape, "they are no finite square table", f"give ({len(u)}, {len(u)})")
        if np.abs(np.diag(F)).max() > 1e-12 * max(np.abs(np.tril(F)).max(), 1e-300):
            raise BadParameter("values", np.abs(np.diag(F)).max(), "F(a, a) is not 0", "F(a, a) = 0: no triangle")
        self.levels, self.values, self.middle = u, np.tril(F, -1), middle

    def __call__(self, alpha: float, beta: float) -> float:
        """F at alpha >= beta; values beyond the levels count as the outermost."""
        from simulator.hysteresis import preisach_loop

        return float(preisach_loop.everett(float(alpha), float(beta), self.levels, self.values))

    @property
    def weights(self) -> Array:
        """Masses of mu (n - 1, n - 1) between the levels, alpha by beta: -d2F/(d alpha d beta) of (2.55) times area."""
        F = self.values
        return np.tril(F[1:, :-1] - F[:-1, :-1] - F[1:, 1:] + F[:-1, 1:])

    @classmethod
    def learned(cls, curves: Sequence[ReversalCurve], negative: Negative = "keep", noise: float = 0.0) -> Everett:
        """F from first-order curves by (2.54): half of what the output falls from the reversal.

        negative : what to do where the weight mu is negative, as noise makes it: ``keep`` it, ``refuse`` the curves,
        or ``remove`` it: F nearest to the measured one, by least squares over the grid, whose mu is nowhere negative;
        noise : standard deviation of the outputs, within which curves may seem to cross.
        Raises BadParameter for curves with gaps, crossing curves and, if so asked, a negative weight.

        >>> from simulator.hysteresis import Preisach, first_order_curves
        >>> true = Preisach(lambda a, b: (a - b) ** 2 / 2, 0.0, 1.0)
        >>> Everett.learned(first_order_curves(true.update, [0.0, 0.25, 0.5, 0.75, 1.0]))(1.0, 0.25)
        0.28125
        """
        if negative not in get_args(Negative):
            raise BadParameter(
                "negative", negative, "it is no way to treat it", f"one of {', '.join(get_args(Negative))}"
            )
        levels, outputs = tabulated(curves, noise)
        values = (np.diag(outputs)[:, None] - outputs) / 2
        middle = (outputs[-1, -1] + outputs[0, 0]) / 2
        found = cls(levels, np.tril(np.nan_to_num(values), -1), middle)
        least = found.weights.min()
        if negative == "refuse" and least < -1e-9 * np.abs(values[-1, 0]):
            a, b = np.unravel_index(found.weights.argmin(), found.weights.shape)
            place = f"alpha {levels[a]:g} to {levels[a + 1]:g}, beta {levels[b]:g} to {levels[b + 1]:g}"
            raise BadParameter("curves", "", f"the weight mu is {least:g} at {place}", "ask to keep or remove it")
        return cls(levels, _positive(found), middle) if negative == "remove" and least < 0 else found


def _positive(found: Everett) -> Array:
    """Values (n, n) of F nearest to those found, summed up from masses that are not negative."""
    n = len(found.levels)
    rows, columns = np.tril_indices(n, -1)
    a, b = np.tril_indices(n - 1)
    inside = (a[None, :] < rows[:, None]) & (b[None, :] >= columns[:, None])
    masses, _ = nnls(inside.astype(float), found.values[rows, columns])
    values = np.zeros((n, n))
    values[rows, columns] = inside @ masses
    return values
