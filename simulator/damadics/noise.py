"""The benchmark's noise: mains hum and white noise on every normalised signal, the same however a run is cut up.

Each value is a pure function of seed, channel and step number (SplitMix64 used as a counter-based generator; Steele,
Lea & Flood, OOPSLA 2014), so a run in blocks, a decimated run and a restarted run see the same noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from recordings import Array, BadInput, Integers

CHANNELS = ("CV", "P1", "P2", "T1", "X", "F", "CVI", "Ps", "Pz")
"""The measured signals, in the order of the columns of `Noise.measured`."""

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_HALF = np.sqrt(0.5)
_HUM = np.array([0.0, _HALF, 1.0, _HALF, 0.0, -_HALF, -1.0, -_HALF])
"""50 Hz sampled every 2.5 ms repeats after 8 steps; sampled at 1 s it vanishes."""


@dataclass(frozen=True)
class Noise:
    """Noise of a seed. white : standard deviation per step of 2.5 ms; hum : amplitude at 50 Hz; in shares of a span.

    The default white noise is that of the library: density 5e-9 over 2.5 ms. Raises `BadInput` for a negative
    seed or size.

    >>> long, short = (Noise(seed=1).setpoint(np.arange(n)) for n in (5, 3))
    >>> bool((long[:3] == short).all())
    True
    """

    seed: int
    white: float = (5e-9 / 0.0025) ** 0.5
    hum: float = 0.0025

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise BadInput("noise", f"the seed is {self.seed}", "a seed is a whole number, not negative")
        for name, value in (("standard deviation", self.white), ("amplitude of the hum", self.hum)):
            if not (np.isfinite(value) and value >= 0):
                raise BadInput("noise", f"the {name} is {value:g}", "it is a share of the span, not negative")

    def setpoint(self, steps: Integers) -> Array:
        """What is added to CV on its way into the actuator, shape (n,), for step numbers (n,)."""
        return self._channel(CHANNELS.index("CV"), steps)

    def measured(self, steps: Integers) -> Array:
        """What is added to the normalised measurements, shape (n, 9), columns `CHANNELS`; CV has its noise already."""
        silent = np.zeros(len(steps))
        return np.column_stack([silent, *(self._channel(number, steps) for number in range(1, len(CHANNELS)))])

    def deviation(self, stride: int) -> float:
        """Standard deviation of the noise in a record of every `stride`-th step [share of a span]."""
        hum = self.hum * _HUM[np.arange(0, stride * len(_HUM), stride) % len(_HUM)]
        return float(np.sqrt(self.white**2 + np.mean(hum**2)))

    def _channel(self, number: int, steps: Integers) -> Array:
        return self.white * normal(self.seed, number, steps) + self.hum * _HUM[steps % len(_HUM)]


def normal(seed: int, channel: int, steps: Integers) -> Array:
    """Standard normal numbers, shape (n,), one for each step number of a channel of a seed."""
    key = np.random.SeedSequence([seed, channel]).generate_state(1, np.uint64)[0]
    bits = _mixed(key + steps.astype(np.uint64) * _GOLDEN)
    return ndtri(((bits >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53)


def _mixed(z: NDArray[np.uint64]) -> NDArray[np.uint64]:
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))
