"""The dedicated neural scheme: for each output an observer that is driven by all inputs and by that output alone."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from detector.generators.contract import Generator
from detector.generators.neural.observer import NeuralObserver, learn_neural
from recordings import Array


@dataclass(frozen=True, eq=False)
class DedicatedNeural(Generator):
    """Residuals (m * m): observer by observer the residuals of all outputs, of unit deviation without a fault.

    observers : one for each output, in their order; each predicts every output from the inputs and its own output. So
    a sensor that is wrong moves all residuals of its own observer, and of every other one only the one about itself:
    `suspects` says which output that points at. A fault of the plant moves them all.
    """

    observers: tuple[NeuralObserver, ...]

    @property
    def width(self) -> tuple[int, int, int]:
        """A residual for every observer and output."""
        m = len(self.observers)
        return self.observers[0].sizes[0], m, m * m

    def initial(self) -> Array:
        """No past yet."""
        return np.concatenate([one.initial() for one in self.observers])

    def healthy(self, residuals: Array) -> Array:
        """How far each observer is off where it should not be (n, m): the RMS of its residuals about other outputs.

        When the sensor of output j alone is wrong, that of j is large and all others are as without a fault.
        """
        m = len(self.observers)
        squares = residuals.reshape(-1, m, m) ** 2
        apart = ~np.eye(m, dtype=bool)
        return np.sqrt(np.stack([squares[:, j, apart[j]].mean(axis=1) for j in range(m)], axis=1))

    def suspects(self, residuals: Array, limit: float) -> Array:
        """The number of the output (n,) whose observer alone exceeds a limit; -1 where none or more than one does."""
        over = self.healthy(residuals) > limit
        return np.where(over.sum(axis=1) == 1, over.argmax(axis=1), -1)

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        ends = np.cumsum([0, *(len(one.initial()) for one in self.observers)])
        states, residuals = [], []
        for j, (one, (first, last)) in enumerate(zip(self.observers, pairwise(ends), strict=True)):
            after, residual = one.run(state[first:last], u, np.roll(y, -j, axis=1))
            states.append(after)
            residuals.append(np.roll(residual, j, axis=1))
        return np.concatenate(states), np.hstack(residuals)


def learn_dedicated(u: Array, y: Array, depth: int = 3, hidden: int = 80, seed: int = 0) -> DedicatedNeural:
    """Learn from fault-free rows u (n, r), y (n, m), m from 2 on. Raises BadInput for too few rows."""
    observers = (learn_neural(u, np.roll(y, -j, axis=1), depth, hidden, seed + j, driven=1) for j in range(y.shape[1]))
    return DedicatedNeural(tuple(observers))
