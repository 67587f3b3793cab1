"""A valve in series with a linear process, and what OP and PV say of both: the posterior density.

PV = g F(q) x(k - d) + c + v: a first-order process F with unit gain (an integrator in a level loop) and a delay of d
samples, behind the position x of the stem; v is a disturbance that wanders and white noise, together ARMA(1, 1). Gain
g, offset c and the size of the noise have flat priors and are integrated out (Zellner 1971, An Introduction to Bayesian
Inference in Econometrics, chapter 3). The priors of the valve are those of plausible valves, log-uniform.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from identification.loops.joint.stem import stem_path
from identification.loops.loop import ControlLoop
from recordings import Array

VALVE = ("fc", "excess", "sigma2", "vs", "mass")
"""Unknowns of the valve, as logarithms: fc and fs/fc - 1, viscous friction, Stribeck velocity, mass."""
PRIOR: Mapping[str, tuple[float, float]] = {
    "excess": (0.1, 3.0), "sigma2": (100.0, 1000.0), "vs": (1e-3, 1e-2), "mass": (1.0, 10.0),
}  # fmt: skip
"""Ranges [1], [N s/m], [m/s], [kg]; fc goes from 0.1 % to 20 % of the force of the whole range of OP."""
FC_SHARE = (1e-3, 0.2)
BRISTLE = {"lugre.sigma0": 1e6, "lugre.sigma1": 1e3}
"""Held: presliding is over within a sample."""
PROCESS = ("tau", "wander", "smear")
"""Unknowns of process and noise: logarithm of the time constant [samples], pole and zero of the noise as atanh."""
TAU, MOST_DELAY = (0.3, 300.0), 15


@dataclass(frozen=True)
class JointSeries:
    """force (m,) [N] of OP about its mean, from the start of the stem on; pv (n,), from a sample on that is later or
    the same; K [N/m] and full [N] of the valve; way : as of `stem_path`.
    """

    force: Array
    pv: Array
    K: float
    full: float
    integrating: bool
    way: float

    @classmethod
    def of(cls, loop: ControlLoop, K: float, full: float, start: int, first: int, way: float) -> JointSeries:
        """The series of a loop whose stem starts where OP is at an extreme; PV counts from the sample `first` on."""
        force = full * (loop.op[start:] - loop.op.mean()) / 100
        return cls(force, loop.pv[first:] - loop.pv.mean(), K, full, loop.integrating, way)

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Lower and upper end of every prior of the valve."""
        return {"fc": (FC_SHARE[0] * self.full, FC_SHARE[1] * self.full), **PRIOR}

    def values(self, valve: Array) -> dict[str, float]:
        """Parameters of the base effects for the unknowns of the valve (5,)."""
        fc, excess, sigma2, vs, mass = np.exp(valve)
        return {
            "mass.m": mass, "spring.K": self.K, "spring.F0": 0.0, "lugre.fc": fc, "lugre.fs": fc * (1 + excess),
            "lugre.vs": vs, "lugre.sigma2": sigma2, **BRISTLE,
        }  # fmt: skip

    def path(self, valve: Array) -> Array | None:
        """The stem for the unknowns of the valve, (n,) in % of the range of OP; None outside the priors."""
        for value, (low, high) in zip(np.exp(valve), (self.ranges()[name] for name in VALVE), strict=True):
            if not low <= value <= high:
                return None
        found = stem_path(self.values(valve), self.force, self.way)
        return None if found is None else 100 * self.K / self.full * found[-len(self.pv) :]

    def regression(self, path: Array, process: Array, delay: int) -> tuple[Array, Array] | None:
        """Whitened PV (m,) and its regressors (m, k), the process' answer first; None outside the priors."""
        tau, pole, zero = float(np.exp(process[0])), float(np.tanh(process[1])), float(np.tanh(process[2]))
        if not TAU[0] <= tau <= TAU[1] or not 0 <= delay <= MOST_DELAY or max(abs(pole), abs(zero)) > 0.9999:
            return None
        keep = 1.0 if self.integrating else float(np.exp(-1 / tau))
        entry = 1.0 if self.integrating else 1 - keep
        answer = lfilter([entry], [1, -keep], path[: len(path) - delay] - path[0])
        k = np.arange(len(answer))
        unknown = k / len(k) if self.integrating else keep**k  # where the process rests, or where it began
        columns = np.column_stack([self.pv[delay:], answer, np.ones(len(k)), unknown])
        white = lfilter([1, -pole], [1, -zero], columns, axis=0)[MOST_DELAY + 5 - delay :]
        return white[:, 0], white[:, 1:]

    def density(self, path: Array, process: Array, delay: int) -> float:
        """Logarithm of the posterior density, gain, offset and size of the noise integrated out; -inf outside."""
        found = self.regression(path, process, delay)
        if found is None:
            return -np.inf
        y, x = found
        gram, gift = x.T @ x, x.T @ y
        sign, size = np.linalg.slogdet(gram + 1e-12 * np.eye(len(gram)))
        rest = float(y @ y - gift @ np.linalg.lstsq(gram, gift, rcond=None)[0])
        flat = float(sum(np.log1p(-(np.tanh(process[1:]) ** 2))))
        return -0.5 * (len(y) - len(gram)) * float(np.log(max(rest, 1e-300))) - 0.5 * float(size) * sign + flat

    def gain(self, path: Array, process: Array, delay: int, rng: np.random.Generator) -> float:
        """A draw of the gain from its Student distribution given everything else."""
        found = self.regression(path, process, delay)
        assert found is not None
        y, x = found
        inverse = np.linalg.inv(x.T @ x)
        middle = inverse @ (x.T @ y)
        free = len(y) - x.shape[1]
        spread = float(np.sum((y - x @ middle) ** 2)) / free
        return float(middle[0] + np.sqrt(spread * inverse[0, 0]) * rng.standard_t(free))
