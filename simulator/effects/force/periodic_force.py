"""A disturbance that is periodic in time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing, Trial
from simulator.pulls import rhythms

FEWEST_PERIODS, HIGHEST = 1.5, 40.0
"""For a first guess: of fewer periods it looks like a drift, and above that frequency [Hz] a valve hardly moves."""


class PeriodicForce(Effect):
    """F = a sin(2 pi f t) + b cos(2 pi f t), t from the recording's own clock; its amplitude is hypot(a, b).

    With a frequency given it is linear in a and b. The frequency has to be found to about a quarter of a period over
    the recording before a fit can refine it.
    """

    id = "periodic_force"
    site = Site.FORCE
    sentence = "a force of its own rhythm acts on the stem: pulsation, vibration or another loop that oscillates"
    check = "pumps, compressors and control loops nearby for the named frequency"
    parameters = (
        Parameter("a", "N", "amplitude of the sine", scale=10.0, neutral=0.0),
        Parameter("b", "N", "amplitude of the cosine", scale=10.0, neutral=0.0),
        Parameter("f", "Hz", "frequency", scale=2.0, lower=0.0, positive=True),
    )

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        phase = 2 * math.pi * p["f"] * q.t
        return p["a"] * ca.sin(phase) + p["b"] * ca.cos(phase)

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The strongest rhythms in which the measurements pull at the stem."""

        def trial(f: float) -> Trial:
            return {"f": f}, {
                "a": lambda r: np.sin(2 * math.pi * f * r.t), "b": lambda r: np.cos(2 * math.pi * f * r.t)
            }  # fmt: skip

        span = max(float(r.t[-1] - r.t[0]) for r in recordings)
        highest = min(HIGHEST, *(0.5 / float(np.median(np.diff(r.t))) for r in recordings))
        found = rhythms(
            [r.t for r in recordings], [r.pulled(base) for r in recordings], FEWEST_PERIODS / span, highest
        )  # fmt: skip
        missing = Missing.of(recordings, base)
        return [guess for f in found for guess in self.guessed(missing.best([trial(f)]))]
