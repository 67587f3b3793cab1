"""A force that is periodic in position."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing, Trial, travel
from simulator.pulls import rhythms

FEWEST, MOST = 1.5, 150.0
"""Periods that the travel may hold, for a first guess: of fewer it looks like a curved spring, and a fine thread has
that many."""


class PositionPeriodicForce(Effect):
    """F = a sin(2 pi x/l) + b cos(2 pi x/l), l the pitch: screw, thread, gear, coil of a spring, cogging of a motor.

    With a pitch given it is linear in a and b. A pitch near the stroke or above it looks like a curved spring.
    """

    id = "position_periodic_force"
    site = Site.FORCE
    sentence = "a force repeats along the stroke at a fixed pitch, as with a screw, a gear or a coil"
    check = "drive screw, gear or spring for the named pitch, and for damage that comes round with it"
    parameters = (
        Parameter("a", "N", "amplitude of the sine", scale=10.0, neutral=0.0),
        Parameter("b", "N", "amplitude of the cosine", scale=10.0, neutral=0.0),
        Parameter("pitch", "m", "distance after which the force repeats", 5e-3, lower=0.0, positive=True),
    )  # fmt: skip

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        phase = 2 * math.pi * q.x / p["pitch"]
        return p["a"] * ca.sin(phase) + p["b"] * ca.cos(phase)

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The strongest rhythms along the stroke in which the measurements pull at the stem."""

        def trial(pitch: float) -> Trial:
            return {"pitch": pitch}, {
                "a": lambda r: np.sin(2 * math.pi * r.x / pitch), "b": lambda r: np.cos(2 * math.pi * r.x / pitch)
            }  # fmt: skip

        low, high = travel(recordings)
        if low == high:
            return []
        found = rhythms(
            [r.x for r in recordings], [r.pulled(base) for r in recordings], FEWEST / (high - low), MOST / (high - low)
        )  # fmt: skip
        missing = Missing.of(recordings, base)
        return [guess for per_m in found for guess in self.guessed(missing.best([trial(1 / per_m)]))]
