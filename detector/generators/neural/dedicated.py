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
    what it has no part in is as before, and `suspects` names it. A fault of the plant moves them all.
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

    def without(self, residuals: Array) -> Array:
        """RMS (n, m) of the residuals that output j has no part in: it is neither driver nor subject."""
        m = len(self.observers)
        squares = residuals.reshape(-1, m, m) ** 2
        kept = [[i for i in range(m) if i != j] for j in range(m)]
        return np.sqrt(np.stack([squares[:, rest][:, :, rest].mean(axis=(1, 2)) for rest in kept], axis=1))

    def suspects(self, residuals: Array, limit: float) -> Array:
        """The output (n,) without which all is well, and without no other one; -1 where there is none."""
        calm = self.without(residuals) <= limit
        return np.where(calm.sum(axis=1) == 1, calm.argmax(axis=1), -1)

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
