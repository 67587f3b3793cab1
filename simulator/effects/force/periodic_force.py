"""A disturbance that is periodic in time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing, Trial

FEWEST_PERIODS, HIGHEST, PEAKS = 1.5, 40.0, 4
"""For a first guess: of fewer periods it looks like a drift, above that frequency [Hz] a valve hardly moves, and noise
has peaks, too."""


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
        """The strongest rhythm of what is missing."""

        def trial(f: float) -> Trial:
            return {"f": f}, {
                "a": lambda r: np.sin(2 * math.pi * f * r.t), "b": lambda r: np.cos(2 * math.pi * f * r.t)
            }  # fmt: skip

        return self.guessed(Missing.of(recordings, base).best(map(trial, _frequencies(recordings, base))))


def _frequencies(looks: Sequence[FirstLook], base: Mapping[str, float]) -> list[float]:
    """Frequencies [Hz] about the strongest peaks of the missing force in the longest recording."""
    look = max(looks, key=lambda one: one.t[-1] - one.t[0])
    even = np.linspace(look.t[0], look.t[-1], len(look.t))
    signal = np.interp(even, look.t, np.where(look.slides, look.missing(base), 0.0))
    power = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(len(signal)))) ** 2
    f, span = np.fft.rfftfreq(len(even), even[1] - even[0]), float(even[-1] - even[0])
    power = np.where((f * span > FEWEST_PERIODS) & (f < HIGHEST), power, 0.0)
    inner = (power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])
    peaks = 1 + np.flatnonzero(inner)
    strongest = peaks[np.argsort(-power[peaks])][:PEAKS]
    return [float(f[i] + part / span) for i in strongest for part in (-0.5, -0.25, 0.0, 0.25, 0.5)]
