"""LuGre valves written a second time, for scipy's Radau: what the kernels are measured against."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

STROKE = 0.02
"""Stroke [m] that errors are related to."""


@dataclass(frozen=True)
class Valve:
    """Parameters in SI units."""

    m: float = 3.0
    K: float = 3e4
    F0: float = 300.0
    fc: float = 150.0
    fs: float = 200.0
    vs: float = 5e-3
    sigma0: float = 1e6
    sigma1: float = 1e3
    sigma2: float = 300.0

    @classmethod
    def stiff(cls, sigma0: float) -> Valve:
        """A valve with half-critically damped bristles that yield within 1 mm at most."""
        level = min(1.0, sigma0 * 1e-3 / 150.0)
        bristle = cls(fc=150 * level, fs=200 * level, sigma0=sigma0)
        return replace(bristle, sigma1=np.sqrt(sigma0 * bristle.m))

    def values(self) -> dict[str, float]:
        """By full parameter name."""
        prefix = {"m": "mass", "K": "spring", "F0": "spring"}
        return {f"{prefix.get(symbol, 'lugre')}.{symbol}": value for symbol, value in asdict(self).items()}

    def level(self, v):
        """Friction level at steady sliding [N]."""
        return self.fc + (self.fs - self.fc) * np.exp(-((v / self.vs) ** 2))

    def friction(self, v, z, factor=1.0):
        """Friction force [N] and dz/dt [m/s]."""
        dz = v - self.sigma0 * abs(v) * z / (self.level(v) * factor)
        return self.sigma0 * z + self.sigma1 * dz + self.sigma2 * v, dz

    def motion(self, t, state, force):
        """d(x, v, z)/dt."""
        x, v, z = state
        friction, dz = self.friction(v, z)
        return v, (force(t) - self.K * x - self.F0 - friction) / self.m, dz


def slow_force(t):
    """A force [N] that moves the valve to and fro, slowly enough to stick at every reversal."""
    return 600 + 180 * np.sin(2 * np.pi * 2.5 * t) + 120 * np.sin(2 * np.pi * 0.9 * t)


def solve(right_hand_side, start, t):
    """A trajectory (n_states, n_samples) by Radau at 1e-10."""
    scale = np.array([1e-13, 1e-11, *[1e-15] * (len(start) - 2)])
    found = solve_ivp(right_hand_side, (t[0], t[-1]), start, "Radau", t_eval=t, rtol=1e-10, atol=scale, max_step=0.01)
    assert found.success, found.message
    return found.y


def break_aways(valve, v, z):
    """How often the bristles go from half-loaded at most to fully yielding."""
    load = abs(z) * valve.sigma0 / valve.level(v)
    phases = np.where(load > 0.98, 1, np.where(load < 0.5, 0, -1))
    return int((np.diff(phases[phases >= 0]) == 1).sum())
