"""Spectrum analysis: the power of each measurement in bands of frequency, against what is usual (3.2.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.generators.contract import Generator, windows, with_past
from recordings import Array, BadInput

_BLOCK = 4096


@dataclass(frozen=True, eq=False)
class Spectrum(Generator):
    """log10(power / usual power) in each band, over the last `length` readings under a Hann window.

    bands : edges in shares of half the sampling rate, rising from 0 to 1; usual (m, n_bands). The residuals come
    measurement by measurement; zero until there are `length` readings.
    """

    length: int
    bands: tuple[float, ...]
    usual: Array

    @property
    def width(self) -> tuple[int, int, int]:
        """No inputs, one residual per measurement and band."""
        return 0, len(self.usual), self.usual.size

    def initial(self) -> Array:
        """No readings yet."""
        return np.full((self.length - 1) * len(self.usual), np.nan)

    def power(self, y: Array) -> Array:
        """Power (n - length + 1, m, n_bands) of every stretch of measurements (n, m), their mean taken off."""
        windowed = windows(y, self.length - 1)
        return np.concatenate([self._power(windowed[i : i + _BLOCK]) for i in range(0, len(windowed), _BLOCK)])

    def _power(self, windowed: Array) -> Array:
        window = np.hanning(self.length)[None, :, None]
        lines = np.abs(np.fft.rfft((windowed - windowed.mean(axis=1, keepdims=True)) * window, axis=1)) ** 2
        share = np.arange(lines.shape[1]) / (lines.shape[1] - 1)
        inside = [(share >= low) & (share <= high) for low, high in zip(self.bands, self.bands[1:], strict=False)]
        return np.stack([lines[:, one].mean(axis=1) for one in inside], axis=2) / self.length

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        joined, state = with_past(state, y, self.length - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.log10(self.power(joined) / self.usual)
        return state, np.nan_to_num(found, posinf=0.0, neginf=0.0).reshape(len(y), -1)


def learn_spectrum(y: Array, length: int = 128, bands: tuple[float, ...] = (0.0, 0.1, 0.3, 1.0)) -> Spectrum:
    """The usual power of fault-free measurements (n, m). Raises BadInput for fewer than two stretches of `length`."""
    if len(y) < 2 * length:
        raise BadInput("spectrum", f"{len(y)} readings", f"give at least {2 * length}")
    blank = Spectrum(length, bands, np.ones((y.shape[1], len(bands) - 1)))
    return Spectrum(length, bands, np.exp(np.mean(np.log(blank.power(y) + 1e-30), axis=0)))
