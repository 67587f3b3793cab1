"""Friction with a smoothed sign, and its parameters as states of an observer (section 2.1, the form of [1])."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadInput, BadParameter

SLOPE = 30.0
"""sigma of tanh(sigma v), v in units of the Stribeck velocity: the value that the source recommends."""
NAMES = ("fc", "excess", "sigma2")


def smoothed_friction(velocity: ArrayLike, fc: float, fs: float, vs: float, sigma2: float, slope: float) -> Array:
    """(2.17) with tanh(slope v) for sgn(v) (n_samples) [N]; slope [s/m], velocity [m/s], the others as in (2.17)."""
    v = np.asarray(velocity, dtype=float)
    return (fc + (fs - fc) * np.exp(-((v / vs) ** 2))) * np.tanh(slope * v) + sigma2 * v


@dataclass(frozen=True)
class ObservedFriction:
    """t-wise estimates: velocity (n_samples) [m/s] and parameters (n_samples, n_parameters) in the order of `names`."""

    names: tuple[str, ...]
    velocity: Array
    parameters: Array


class TanhObserver:
    """An observer of m dv/dt = u - F(v) whose parameters are states: dp/dt = 0 beside v (Luenberger, varying gain).

    mass [kg]; vs : Stribeck velocity [m/s], known; slope [s/m] of tanh, 30/vs where not given; unknown : which of fc,
    excess (fs - fc) and sigma2 are estimated; known : values of the others. F is linear in them:
    m dv/dt = u - phi(v) p. With e = v - v-hat,

        dv-hat/dt = (u - phi p-hat)/m + pole e,    dp-hat/dt = -gain phi e,

    so m e^2/2 + (p - p-hat)' gain^-1 (p - p-hat)/2 falls at m pole e^2. The error of v shrinks at `pole` [1/s]; the
    gain is rate m pole times the inverse of the mean of phi phi', so that all parameters come at about `rate` [1/s].

    Before it runs, the motion is checked: the Gramian of phi over the record, scaled to unit columns, has a condition
    number; above `worst` the parameters are not observable and it refuses.
    Raises BadParameter for a mass, vs, slope, pole or rate that is not positive, and unknown names.
    """

    def __init__(
        self,
        mass: float,
        vs: float,
        slope: float | None = None,
        unknown: tuple[str, ...] = NAMES,
        known: dict[str, float] | None = None,
        pole: float = 50.0,
        rate: float = 1.0,
        worst: float = 1e4,
    ) -> None:
        slope = SLOPE / vs if slope is None and vs else slope or 0.0
        given = {"mass": mass, "vs": vs, "slope": slope, "pole": pole, "rate": rate, "worst": worst}
        for name, value in given.items():
            if not 0 < value < np.inf:
                raise BadParameter(name, f"{value:g}", "it is not a positive number", "give more than 0")
        if not unknown or set(unknown) | set(known or {}) != set(NAMES) or set(unknown) & set(known or {}):
            raise BadParameter("unknown", ", ".join(unknown), "these and the known ones are not fc, excess and sigma2",
                               "give each of the three once, as unknown or known")  # fmt: skip
        self._mass, self._vs, self._slope = mass, vs, slope
        self._unknown, self._known = tuple(unknown), known or {}
        self._pole, self._rate, self._worst = pole, rate, worst

    def regressors(self, velocity: Array) -> dict[str, Array]:
        """What each parameter is multiplied by in F (n_samples)."""
        sign = np.tanh(self._slope * velocity)
        return {"fc": sign, "excess": np.exp(-((velocity / self._vs) ** 2)) * sign, "sigma2": velocity}

    def condition(self, velocity: ArrayLike) -> tuple[float, tuple[str, ...]]:
        """Condition number of the observability Gramian over a motion, and the parameters in its weakest direction."""
        columns = self.regressors(np.asarray(velocity, dtype=float))
        phi = np.column_stack([columns[name] for name in self._unknown])
        size = np.linalg.norm(phi, axis=0)
        if (size == 0).any():
            return np.inf, tuple(n for n, s in zip(self._unknown, size, strict=True) if s == 0)
        _, values, rows = np.linalg.svd(phi / size, full_matrices=False)
        weak = tuple(n for n, part in zip(self._unknown, np.abs(rows[-1]), strict=True) if part > 0.3)
        return float((values[0] / max(values[-1], 1e-300)) ** 2), weak

    def follow(self, time: ArrayLike, force: ArrayLike, velocity: ArrayLike) -> ObservedFriction:
        """Estimates along a record: time [s], force u on the body [N] and measured velocity [m/s] (n_samples each).

        Raises BadParameter for rows that differ or times that do not rise, BadInput where the motion does not tell the
        parameters: it says which.
        """
        t, u, v = (np.asarray(row, dtype=float) for row in (time, force, velocity))
        if not t.shape == u.shape == v.shape or t.ndim != 1 or len(t) < 3 or not (np.diff(t) > 0).all():
            raise BadParameter("time", t.shape, f"beside force {u.shape} and velocity {v.shape}", "rising, equal rows")
        condition, weak = self.condition(v)
        if not condition < self._worst:
            found = f"observability is lost: the Gramian has condition {condition:.2g} (at most {self._worst:g})"
            raise BadInput("velocity", found, f"the motion does not tell {', '.join(weak)} apart: estimate fewer, or "
                           "move slowly and fast")  # fmt: skip
        columns = self.regressors(v)
        phi = np.column_stack([columns[name] for name in self._unknown])
        rest = u - sum((columns[name] * value for name, value in self._known.items()), start=np.zeros_like(v))
        return self._run(t, rest, v, phi)

    def _run(self, t: Array, force: Array, v: Array, phi: Array) -> ObservedFriction:
        gain = self._rate * self._mass * self._pole * np.linalg.inv(phi.T @ phi / len(phi))
        p, seen = np.zeros(phi.shape[1]), float(v[0])
        speeds, parameters = np.empty(len(t)), np.empty((len(t), len(p)))
        for k in range(len(t)):
            speeds[k], parameters[k] = seen, p
            h = t[min(k + 1, len(t) - 1)] - t[k]
            error = v[k] - seen
            seen += h * ((force[k] - phi[k] @ p) / self._mass + self._pole * error)
            p = p - h * (gain @ phi[k]) * error
        return ObservedFriction(self._unknown, speeds, parameters)
