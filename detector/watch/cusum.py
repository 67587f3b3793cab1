"""Sequential tests on the innovation: has a parameter changed, and which one?

One CUSUM for each direction of change and each sign: the running log-likelihood ratio of a change by a given size, set
to zero whenever it speaks against a change (Page 1954; Basseville and Nikiforov 1993, section 2.2). What no direction
explains shows in the energy of the innovation. In rest no parameter shows, so that the sums stand still.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from detector.watch.model.filter import DIRECTIONS, PredictionError
from recordings import Array

N = len(DIRECTIONS)

CLIP = 6.0
"""An innovation counts as so many standard deviations at most: one wild sample is no change."""

OVERFLOW = 2.0
"""A sum rises to this many times its limit and no further, so that it can come down again."""


class Evidence(NamedTuple):
    """The sums: rising, falling (n_directions,) for a change up and down, energy for any other."""

    rising: Array
    falling: Array
    energy: float


@dataclass(frozen=True)
class ChangeTest:
    """sizes (n_directions,) : change that each direction is tested for; usual : mean of the normalised energy of the
    innovation without a fault; limits (n_directions + 1,) : of the sums, the last of the energy.
    """

    sizes: tuple[float, ...]
    usual: float
    limits: tuple[float, ...]

    def start(self) -> Evidence:
        """No evidence."""
        return Evidence(np.zeros(N), np.zeros(N), 0.0)

    def step(self, before: Evidence, seen: PredictionError) -> Evidence:
        """The sums after one innovation."""
        variance = seen.variance * self.usual
        bound = CLIP * sqrt(variance)
        value, shows = min(max(seen.value, -bound), bound), seen.slope[:N]
        sizes, most = self._sizes, OVERFLOW * self._limits
        gained, cost = sizes * shows * value / variance, 0.5 * sizes**2 * shows**2 / variance
        energy = value * value / variance
        return Evidence(
            np.clip(before.rising + gained - cost, 0.0, most[:N]),
            np.clip(before.falling - gained - cost, 0.0, most[:N]),
            float(min(max(before.energy + energy - 2.0, 0.0), most[N])),
        )

    def scores(self, evidence: Evidence) -> Array:
        """Each sum over its limit, (n_directions + 1,); above 1 means alarm."""
        sums = np.append(np.maximum(evidence.rising, evidence.falling), evidence.energy)
        return sums / self._limits

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        return {"sizes": list(self.sizes), "usual": self.usual, "limits": list(self.limits)}

    @classmethod
    def from_dict(cls, parts: dict[str, Any]) -> ChangeTest:
        """What `as_dict` gave."""
        return cls(tuple(parts["sizes"]), parts["usual"], tuple(parts["limits"]))

    @property
    def _sizes(self) -> Array:
        return np.array(self.sizes)

    @property
    def _limits(self) -> Array:
        return np.array(self.limits)
