"""Kalman filter innovations, and a bank of filters matched to what each fault does to them (3.2.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from detector.arithmetic.native import native
from detector.generators.contract import Generator, windows, with_past
from detector.generators.plant import LinearPlant
from recordings import Array, BadInput


@dataclass(frozen=True, eq=False)
class KalmanResiduals(Generator):
    """Innovations of the settled Kalman filter, whitened: of zero mean and unit covariance without a fault.

    plant : without noise; gain (n, m) : of the predictor, x^(k+1) = A x^(k) + B u(k) + gain e(k); whitener (m, m) :
    inverse root of the innovations' covariance.
    """

    plant: LinearPlant
    gain: Array
    whitener: Array

    @property
    def width(self) -> tuple[int, int, int]:
        """As many residuals as outputs."""
        r, m, _ = self.plant.sizes
        return r, m, m

    def initial(self) -> Array:
        """x = 0."""
        return np.zeros(self.plant.order)

    def response(self, fault: int, length: int) -> Array:
        """Whitened innovations (length, m) that a unit step of a fault of the plant brings about."""
        r, _, g = self.plant.sizes
        f, u = np.zeros((length, g)), np.zeros((length, r))
        f[:, fault] = 1.0
        return self.run(self.initial(), u, self.plant.simulate(u, f=f))[1]

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        out, p = np.empty_like(y), self.plant
        _filter(state, *(np.ascontiguousarray(a) for a in (p.A, p.B, p.C, p.D, self.gain, u, y)), out)
        return state, out @ self.whitener.T


def settled(plant: LinearPlant, Q: Array, R: Array, S: Array | None = None) -> KalmanResiduals:
    """The filter for process noise w of covariance Q (n, n), measurement noise v of R (m, m) and S = E[w v'] (n, m),
    zero where not given: P solves the Riccati equation with S in it, gain = (A P C' + S)(C P C' + R)^-1.

    Where both noises come from one source, as in every model learned from past readings, S is not zero, and without it
    the innovations are not white. Raises BadInput when there is no such filter.
    """
    from scipy.linalg import solve_discrete_are

    A, C = plant.A, plant.C
    Q, R = np.asarray(Q, float), np.asarray(R, float)
    S = np.zeros((len(A), len(C))) if S is None else np.asarray(S, float)
    try:
        P = solve_discrete_are(A.T, C.T, Q, R, s=S)
    except (np.linalg.LinAlgError, ValueError) as error:
        found = f"the Riccati equation has no solution ({error})"
        raise BadInput("Kalman filter", found, "check that (C, A) is detectable and Q, R positive") from None
    innovation = C @ P @ C.T + R
    values, vectors = np.linalg.eigh(innovation)
    gain = np.linalg.solve(innovation, (A @ P @ C.T + S).T).T
    return KalmanResiduals(plant, gain, (vectors / np.sqrt(values)) @ vectors.T)


@dataclass(frozen=True, eq=False)
class MatchedFilters(Generator):
    """For each suspected fault the best match of the last innovations with its response, over all arrival times.

    responses : whitened innovations (length, m) after the arrival, by fault. Inputs: none; outputs: the innovations.
    A residual is sum(g r) / sqrt(sum(g^2)), of unit deviation without a fault; of all arrival times within `length`
    the one that matches best counts, with its sign.
    """

    responses: Mapping[str, Array]

    @property
    def names(self) -> tuple[str, ...]:
        """The faults, in the order of the residuals."""
        return tuple(self.responses)

    @property
    def width(self) -> tuple[int, int, int]:
        """One residual per fault."""
        return 0, next(iter(self.responses.values())).shape[1], len(self.responses)

    def initial(self) -> Array:
        """No innovations yet."""
        return np.full((self._length - 1) * self.width[1], np.nan)

    @property
    def _length(self) -> int:
        return len(next(iter(self.responses.values())))

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        joined, state = with_past(state, y, self._length - 1)
        windowed = np.nan_to_num(windows(joined, self._length - 1))
        return state, np.column_stack([_best(windowed, g) for g in self.responses.values()])


def _best(windowed: Array, response: Array) -> Array:
    """The match of largest size over arrival times; a fault that arrived j readings ago shows j + 1 values of it."""
    best = np.zeros(len(windowed))
    for shown in range(1, len(response) + 1):
        g = response[:shown]
        size = np.sqrt((g**2).sum())
        if size > 1e-9:
            match = np.einsum("kjm,jm->k", windowed[:, -shown:], g) / size
            best = np.where(np.abs(match) > np.abs(best), match, best)
    return best


@native
def _filter(x: Array, A: Array, B: Array, C: Array, D: Array, K: Array, u: Array, y: Array, out: Array) -> None:
    """Innovations over rows, changing the predicted state x in place."""
    n, m, r = x.shape[0], y.shape[1], u.shape[1]
    after = np.empty(n)
    for k in range(y.shape[0]):
        for i in range(m):
            miss = y[k, i]
            for j in range(n):
                miss -= C[i, j] * x[j]
            for j in range(r):
                miss -= D[i, j] * u[k, j]
            out[k, i] = miss
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += A[i, j] * x[j]
            for j in range(m):
                total += K[i, j] * out[k, j]
            for j in range(r):
                total += B[i, j] * u[k, j]
            after[i] = total
        x[:] = after
