"""LuGre friction with alpha(x, v) by a network that is linear in its weights, learned on line (equation 2.20-2.26)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter


@dataclass(frozen=True)
class Bells:
    """Gaussian basis S(x, v) of (2.25): exp(-((x - mu1)/width1)^2 - ((v - mu2)/width2)^2).

    centres (n_bells, 2) : mu1 [m] and mu2 [m/s]; widths (2) [m, m/s]. The document prints x twice, and one width for a
    position and a velocity. A width of infinity leaves that quantity out: alpha(v).
    Raises BadParameter for other shapes and widths that are not positive.
    """

    centres: Array
    widths: tuple[float, float]

    def __post_init__(self) -> None:
        c = np.asarray(self.centres, dtype=float)
        if c.ndim != 2 or c.shape[1] != 2 or not len(c) or not np.isfinite(c).all():
            raise BadParameter("centres", c.shape, "they are no finite rows of position and velocity", "(n_bells, 2)")
        if len(self.widths) != 2 or not min(self.widths) > 0:
            raise BadParameter("widths", self.widths, "they are not two positive numbers", "give m and m/s")
        object.__setattr__(self, "centres", c)

    def __call__(self, x: ArrayLike, v: ArrayLike) -> Array:
        """S (n_samples, n_bells) at positions [m] and velocities [m/s] (n_samples)."""
        at = np.stack(np.broadcast_arrays(np.atleast_1d(x), np.atleast_1d(v)), axis=-1).astype(float)
        return np.exp(-(((at[:, None, :] - self.centres) / np.array(self.widths)) ** 2).sum(axis=-1))


class AlphaNetwork:
    """F = sigma0 z + sigma1 dz/dt + sigma2 v, dz/dt = v - alpha abs(v) z (2.23, 2.24), alpha = W' S(x, v) (2.25).

    basis : S; weights W (n_bells) [1/m]; sigma0 [N/m], sigma1, sigma2 [N s/m] known, as the source assumes.
    least, most : bounds of alpha [1/m]: a network has no sign of its own, and at alpha <= 0 a bristle does not yield.
    Raises BadParameter for weights of another length and bounds that are not 0 < least < most.
    """

    def __init__(
        self,
        basis: Bells,
        weights: ArrayLike,
        sigma0: float,
        sigma1: float = 0.0,
        sigma2: float = 0.0,
        bounds: tuple[float, float] = (1.0, np.inf),
    ) -> None:
        self.weights = np.array(weights, dtype=float)
        if self.weights.shape != (len(basis.centres),):
            raise BadParameter("weights", self.weights.shape, f"there are {len(basis.centres)} bells", "one for each")
        for name, value, least in (("sigma0", sigma0, 1e-300), ("sigma1", sigma1, 0.0), ("sigma2", sigma2, 0.0)):
            if not least <= value < np.inf:
                raise BadParameter(name, f"{value:g}", "it is out of range", "sigma0 more than 0, the others 0 or more")
        if not 0 < bounds[0] < bounds[1]:
            raise BadParameter("bounds", bounds, "they are not 0 < least < most", "give 1/m")
        self._basis, self._sigma = basis, (sigma0, sigma1, sigma2)
        self._bounds = bounds

    def alpha(self, x: ArrayLike, v: ArrayLike) -> Array:
        """alpha (n_samples) [1/m], within the bounds."""
        return np.clip(self._basis(x, v) @ self.weights, *self._bounds)

    def follow(self, time: ArrayLike, position: ArrayLike) -> Array:
        """The friction force (n_samples) [N] against a motion [s, m] (n_samples), the bristle exact between samples."""
        return self._run(time, position, None, 0.0, 0.0)[0]

    def learn(
        self, time: ArrayLike, position: ArrayLike, force: ArrayLike, gain: float = 0.5, scale: float = 1.0
    ) -> Array:
        """Adapt the weights along a record, from measured friction force (n_samples) [N]; returns the force errors.

        The measured force gives the bristle: sigma0 z = F - sigma1 dz/dt - sigma2 v, and what it moved over a sample
        gives alpha: dz = dx - alpha z abs(dx), linear in W. Each sample is a normalised step on that (Kaczmarz), gain
        between 0 and 2, so that the weights never move away from such as explain the record; scale : of z abs(dx) S
        [m2] below which a sample tells little, in units of its mean square. Only a moving body adapts.
        Raises BadParameter as `follow`, and for a gain out of range.
        """
        if not 0 < gain < 2:
            raise BadParameter("gain", f"{gain:g}", "it is out of range", "between 0 and 2")
        F = np.asarray(force, dtype=float)
        found, _ = self._run(time, position, F, gain, scale)
        return found - F

    def _run(
        self, time: ArrayLike, position: ArrayLike, force: Array | None, gain: float, scale: float
    ) -> tuple[Array, Array]:
        t, x = np.asarray(time, dtype=float), np.asarray(position, dtype=float)
        if t.shape != x.shape or t.ndim != 1 or len(t) < 2 or not (np.diff(t) > 0).all() or not np.isfinite(x).all():
            raise BadParameter("time", t.shape, f"it does not rise beside positions {x.shape}", "give equal rows")
        if force is not None and (force.shape != t.shape or not np.isfinite(force).all()):
            raise BadParameter("force", force.shape, f"beside times {t.shape}", "give equal finite rows")
        sigma0, sigma1, sigma2 = self._sigma
        h, dx = np.diff(t), np.diff(x)
        S = self._basis((x[1:] + x[:-1]) / 2, dx / h)
        # F - sigma2 v at the middle of each sample is sigma0 z + sigma1 dz/dt there.
        seen = None if force is None else (force[1:] - sigma2 * dx / h)
        weight = (
            0.0 if seen is None else float(np.mean(np.sum((S * (seen / sigma0 * np.abs(dx))[:, None]) ** 2, axis=1)))
        )
        z, out, known = 0.0, np.zeros(len(t)), 0.0
        for k in range(len(dx)):
            alpha = float(np.clip(S[k] @ self.weights, *self._bounds))
            y = alpha * abs(dx[k])
            change = (dx[k] - y * z) * (-np.expm1(-y) / y if y > 0 else 1.0)
            z += change
            out[k + 1] = sigma0 * z + sigma1 * change / h[k] + sigma2 * dx[k] / h[k]
            if seen is None or not dx[k]:
                continue
            after = (seen[k] + sigma1 / h[k] * known) / (sigma0 + sigma1 / h[k])
            row = -(known + after) / 2 * abs(dx[k]) * S[k]
            error = after - known - dx[k] - row @ self.weights
            self.weights += gain * error * row / (row @ row + 1e-3 * scale * weight)
            known = after
        return out, self.weights
