"""The one contract of all residual generators: state, inputs and outputs in, state and residuals out."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from recordings import Array, BadInput


class Generator(ABC):
    """A residual generator; holds no state. Residuals are near zero while nothing has changed.

    A subclass says how many inputs, outputs and residuals it has, where it starts, and how it advances over rows; rows
    that are not finite are passed over here, once for all: their residual is NaN and the state stays.
    """

    @property
    @abstractmethod
    def width(self) -> tuple[int, int, int]:
        """Numbers of inputs, outputs and residuals."""

    @abstractmethod
    def initial(self) -> Array:
        """The state before the first reading, one row of numbers."""

    @abstractmethod
    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        """New state and residuals (n, n_residuals) for finite rows u (n, n_inputs), y (n, n_outputs), n >= 1."""

    @final
    def step(self, state: Array, u: Any, y: Any) -> tuple[Array, Array]:
        """One instant: inputs u (n_inputs,), outputs y (n_outputs,), in the generator's units.

        Returns the state after it and its residuals (n_residuals,).
        """
        state, residuals = self.run(state, np.atleast_2d(u), np.atleast_2d(y))
        return state, residuals[0]

    @final
    def run(self, state: Array, u: Any, y: Any) -> tuple[Array, Array]:
        """Many readings in a row, in blocks of any size: the residuals do not depend on how the row is cut.

        u (n, n_inputs), y (n, n_outputs). Returns the state after them and the residuals (n, n_residuals).
        Raises BadInput for rows of another shape.
        """
        u, y = self._rows(u, y)
        usable = np.isfinite(u).all(axis=1) & np.isfinite(y).all(axis=1)
        residuals = np.full((len(u), self.width[2]), math.nan)
        if usable.any():
            state, residuals[usable] = self._advance(np.array(state, float), u[usable], y[usable])
        return state, residuals

    def _rows(self, u: Any, y: Any) -> tuple[Array, Array]:
        r, m, _ = self.width
        u, y = np.asarray(u, float), np.asarray(y, float)
        if u.ndim != 2 or y.ndim != 2 or u.shape[1] != r or y.shape[1] != m or len(u) != len(y):
            found = f"the inputs are {u.shape} and the outputs {y.shape}"
            raise BadInput("readings", found, f"give rows of {r} inputs and {m} outputs, equally many")
        return u, y


@dataclass(frozen=True)
class EvaluatedGenerator:
    """How a generator takes part in an evaluation, assigned to a name in capitals in the generator's module.

    name : among the detectors; text : what it is, in a line; measurements : the rows (n, m) that the generator reads,
    from the columns (n,) of a run by their names, `detector.evaluation.SIGNALS`, a row a second; learn : the generator
    from such rows without a fault and without the run-in.
    """

    name: str
    text: str
    measurements: Callable[[Mapping[str, Array]], Array]
    learn: Callable[[Array], Generator]


def with_past(state: Array, rows: Array, depth: int) -> tuple[Array, Array]:
    """Rows with `depth` rows before them, and the last `depth` of all, flat, as the state to go on with.

    state : depth * width numbers, NaN where there is no past yet.
    """
    joined = np.vstack([state.reshape(depth, rows.shape[1]), rows])
    return joined, joined[len(joined) - depth :].ravel()


def windows(joined: Array, depth: int) -> Array:
    """For each row from the depth-th on: it and the `depth` rows before it, oldest first, (n, depth + 1, width)."""
    windowed = np.lib.stride_tricks.sliding_window_view(joined, depth + 1, axis=0)
    return np.moveaxis(windowed, 2, 1)
