"""A neural observer: a network of ARX form, linear in its weights, that predicts each output from the past (3.2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.generators.contract import Generator, windows, with_past
from recordings import Array, BadInput


@dataclass(frozen=True, eq=False)
class NeuralObserver(Generator):
    """(y - W s(past)) / deviation: one step ahead, from the last `depth` outputs and the last `depth` + 1 inputs.

    The layer s has the scaled past itself, 1, and `projections` of it through tanh, drawn once from a seed and kept, as
    in a random-feature network: only W is learned, by least squares, so there is one optimum. sizes : numbers of inputs
    and outputs; driven : how many outputs, the first ones, it knows the past of; centre, scale : of the past; weights
    (n_features, m); deviation (m,).
    """

    depth: int
    sizes: tuple[int, int]
    projections: Array
    centre: Array
    scale: Array
    weights: Array
    deviation: Array
    driven: int

    @property
    def width(self) -> tuple[int, int, int]:
        """As many residuals as outputs."""
        return *self.sizes, self.sizes[1]

    def initial(self) -> Array:
        """No past yet."""
        return np.full(self.depth * (self.sizes[0] + self.driven), np.nan)

    def features(self, past: Array) -> Array:
        """The layer s of the past (n, n_past): (n, n_features)."""
        z = (past - self.centre) / self.scale
        hidden = np.tanh(np.column_stack([z, np.ones(len(z))]) @ self.projections)
        return np.column_stack([np.ones(len(z)), z, hidden])

    def _past(self, joined: Array) -> Array:
        """Rows of what is known before the output: past outputs, past and present inputs."""
        past, m = windows(joined, self.depth), self.driven
        return np.hstack([past[:, :-1, :m].reshape(len(past), -1), past[:, :, m:].reshape(len(past), -1)])

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        joined, state = with_past(state, np.hstack([y[:, : self.driven], u]), self.depth)
        past = self._past(joined)
        known, found = np.isfinite(past).all(axis=1), np.zeros_like(y)
        if known.any():
            found[known] = (y[known] - self.features(past[known]) @ self.weights) / self.deviation
        return state, found


def learn_neural(
    u: Array,
    y: Array,
    depth: int = 3,
    hidden: int = 80,
    seed: int = 0,
    ridge: float = 1e-6,
    steepness: float = 2.0,
    driven: int | None = None,
) -> NeuralObserver:
    """Learn from fault-free rows u (n, r), y (n, m).

    steepness : deviation of what goes into tanh, for a past of unit deviation; driven : outputs, the first ones, whose
    past is known, all where not given. Raises BadInput when there are hardly more rows than weights.
    """
    sizes, driven = (u.shape[1], y.shape[1]), y.shape[1] if driven is None else driven
    n_past = depth * (sizes[0] + driven) + sizes[0]
    if len(y) < 2 * (n_past + hidden + 1) + depth:
        raise BadInput("neural observer", f"{len(y)} readings", f"give at least {2 * (n_past + hidden + 1) + depth}")
    drawn = np.random.default_rng(seed).normal(size=(n_past + 1, hidden)) * steepness / np.sqrt(n_past)
    nothing, one = np.zeros((0, 0)), np.ones(sizes[1])
    blank = NeuralObserver(depth, sizes, drawn, np.zeros(n_past), np.ones(n_past), nothing, one, driven)
    past = blank._past(np.hstack([y[:, :driven], u]))
    centre, scale = np.asarray(past.mean(axis=0)), np.asarray(past.std(axis=0) + 1e-9, np.float64)
    shaped = NeuralObserver(depth, sizes, drawn, centre, scale, nothing, one, driven)
    s, target = shaped.features(past), y[depth:]
    weights = np.asarray(np.linalg.solve(s.T @ s + ridge * len(s) * np.eye(s.shape[1]), s.T @ target), np.float64)
    deviation = np.asarray(np.std(target - s @ weights, axis=0) + 1e-12, np.float64)
    return NeuralObserver(depth, sizes, drawn, centre, scale, weights, deviation, driven)
