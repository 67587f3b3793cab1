"""A signal between its samples: its level and its learned waves, tracked from sample to sample.

A wave near half the sampling rate cannot be drawn between samples by a polynomial; knowing its frequency, it can.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.arithmetic.native import native
from recordings import Array, BadInput

PARTS = 10
"""Values given for each second."""

_MOST = 6
_STANDS_OUT = 200.0
"""Power of a line of the spectrum over the median, from which it counts as a wave."""


@dataclass(frozen=True)
class Waves:
    """Tracker of a level and of waves of known frequency.

    frequencies [rad per sample]; level, wave : share of the error that the level, and each wave, take over a sample.
    Without frequencies and with ``level=1`` it holds the last sample.
    """

    frequencies: tuple[float, ...] = ()
    level: float = 1.0
    wave: float = 0.05

    def initial(self) -> Array:
        """Nothing known yet."""
        return np.full(1 + 2 * len(self.frequencies), np.nan)

    def run(self, state: Array, values: Array) -> tuple[Array, Array]:
        """State after values (n,), and the signal (n, PARTS) over the sampling interval before each."""
        now, fine = np.array(state, float), np.empty((len(values), PARTS))
        if np.isnan(now).any():
            now = np.concatenate([values[:1], np.zeros(2 * len(self.frequencies))])
        _track(now, np.ascontiguousarray(values), np.array(self.frequencies), self.level, self.wave, fine)
        return now, fine


def learn_waves(values: Array) -> Waves:
    """The waves of a record (n,), strongest lines of its spectrum. Raises BadInput for fewer than 200 values."""
    if len(values) < 200:
        raise BadInput("record of a process signal", f"{len(values)} values", "give 200 at least")
    left, found = values - values.mean(), []
    for _ in range(_MOST):
        omega, power, usual = _strongest(left)
        if power < _STANDS_OUT * usual:
            break
        found.append(omega)
        t = np.arange(len(left))
        basis = np.column_stack([np.cos(omega * t), np.sin(omega * t)])
        left = left - basis @ np.linalg.lstsq(basis, left, rcond=None)[0]
    explained = 1 - left.var() / values.var()
    return Waves(tuple(found), level=0.1) if found and explained > 0.8 else Waves()


def _strongest(values: Array) -> tuple[float, float, float]:
    """Frequency [rad per sample] and power of the strongest line, and the median power."""
    from scipy.optimize import minimize_scalar

    t, window = np.arange(len(values)), np.hanning(len(values))
    power = np.abs(np.fft.rfft(values * window)) ** 2
    k = int(np.argmax(power[2:-1])) + 2
    step = 2 * np.pi / len(values)

    def lacking(omega: float) -> float:
        return -float(np.abs(np.sum(values * window * np.exp(-1j * omega * t))))

    best = minimize_scalar(lacking, bounds=((k - 1) * step, (k + 1) * step), method="bounded", options={"xatol": 1e-9})
    return float(best.x), float(power[k]), float(np.median(power))


@native
def _track(state: Array, values: Array, omegas: Array, level: float, wave: float, fine: Array) -> None:
    """Track over values, changing `state` in place; the share taken over decays from 1 in no run: it is steady."""
    count = omegas.shape[0]
    for k in range(values.shape[0]):
        expected = state[0]
        for i in range(count):
            c, s = np.cos(omegas[i]), np.sin(omegas[i])
            re, im = state[1 + 2 * i], state[2 + 2 * i]
            state[1 + 2 * i], state[2 + 2 * i] = c * re - s * im, s * re + c * im
            expected += state[1 + 2 * i]
        error = values[k] - expected
        state[0] += level * error
        for i in range(count):
            state[1 + 2 * i] += 2 * wave * error
        for j in range(fine.shape[1]):
            back = (j + 0.5) / fine.shape[1] - 1.0
            fine[k, j] = state[0]
            for i in range(count):
                fine[k, j] += np.cos(omegas[i] * back) * state[1 + 2 * i] - np.sin(omegas[i] * back) * state[2 + 2 * i]
