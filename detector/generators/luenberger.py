"""Residual generators of Luenberger, full-order and functional: equations (3.2) to (3.11).

In discrete time: z(k+1) = F z + K y + J u, r = L1 z + L2 y + L3 u; F is stable with eigenvalues inside the unit
circle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.arithmetic.native import native
from detector.generators.contract import Generator
from detector.generators.parity import null_rows
from detector.generators.plant import LinearPlant
from recordings import Array, BadInput

_EXACT = 1e-8


@dataclass(frozen=True, eq=False)
class Luenberger(Generator):
    """The generator (3.8) with the transformation T that its conditions (3.9) are about."""

    F: Array
    K: Array
    J: Array
    L1: Array
    L2: Array
    L3: Array
    T: Array

    @property
    def width(self) -> tuple[int, int, int]:
        """See `Generator.width`."""
        return self.J.shape[1], self.K.shape[1], self.L1.shape[0]

    def initial(self) -> Array:
        """z = 0."""
        return np.zeros(len(self.F))

    def conditions(self, plant: LinearPlant) -> dict[str, float]:
        """How far each condition of (3.9) is from true: spectral radius of F (below 1), and the largest entry of
        TA - FT - KC, J - TB + KD, L1 T + L2 C, L3 + L2 D, relative to the sizes of what is compared.
        """
        T = self.T
        gaps = {
            "TA - FT = KC": (T @ plant.A, self.F @ T + self.K @ plant.C),
            "J = TB - KD": (self.J, T @ plant.B - self.K @ plant.D),
            "L1 T + L2 C = 0": (self.L1 @ T, -self.L2 @ plant.C),
            "L3 + L2 D = 0": (self.L3, -self.L2 @ plant.D),
        }
        radius = float(np.max(np.abs(np.linalg.eigvals(self.F)), initial=0.0))
        return {"F stable": radius} | {name: _gap(one, other) for name, (one, other) in gaps.items()}

    def holds(self, plant: LinearPlant, tolerance: float = _EXACT) -> bool:
        """Whether all conditions of (3.9) hold."""
        found = self.conditions(plant)
        return found.pop("F stable") < 1 and max(found.values()) <= tolerance

    def fault_response(self, plant: LinearPlant, faults: Array) -> Array:
        """Residuals (n, p) that faults (n, g) alone bring about, by the error dynamics (3.10)."""
        e, found = np.zeros(len(self.F)), np.empty((len(faults), len(self.L1)))
        into = self.K @ plant.R2 - self.T @ plant.R1
        for k, f in enumerate(faults):
            found[k] = self.L1 @ e + self.L2 @ plant.R2 @ f
            e = self.F @ e + into @ f
        return found

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        out = np.empty((len(u), len(self.L1)))
        _run(state, *(np.ascontiguousarray(a) for a in (self.F, self.K, self.J, self.L1, self.L2, self.L3, u, y)), out)
        return state, out


def full_order(plant: LinearPlant, poles: Array, Q: Array | None = None) -> Luenberger:
    """The full-order case, T = I: F = A - KC, J = B - KD, L1 = QC, L2 = -Q, L3 = QD (signs as printed: r = Q(y^ - y)).

    poles (n,) of F; Q (p, m), the unit matrix where not given. Raises BadInput when (C, A) is not observable, or a pole
    is not inside the unit circle.
    """
    from scipy.signal import place_poles

    if not plant.observable:
        raise BadInput("Luenberger generator", "(C, A) is not observable", "use a functional one, or other outputs")
    if np.max(np.abs(poles)) >= 1:
        raise BadInput("Luenberger generator", f"poles {np.asarray(poles)}", "give poles inside the unit circle")
    K = place_poles(plant.A.T, plant.C.T, np.asarray(poles)).gain_matrix.T
    Q = np.eye(plant.sizes[1]) if Q is None else np.atleast_2d(np.asarray(Q, float))
    J = plant.B - K @ plant.D
    return Luenberger(plant.A - K @ plant.C, K, J, Q @ plant.C, -Q, Q @ plant.D, np.eye(plant.order))


def functional(plant: LinearPlant, poles: Array, which: int = 0) -> Luenberger:
    """A generator of the order q of `poles`, one residual, built from a parity vector v of depth q.

    With v W = 0: T_i = sum over j >= i of v_j C A^(j-i), F is a shift whose last column sets the poles, and (3.9)
    holds by construction (the one-to-one relation named in 3.2.2). which : which parity vector of that depth.
    Raises BadInput when no such generator exists, that is when there is no parity vector of that depth.
    """
    q, m = len(poles), plant.sizes[1]
    vectors = null_rows(plant.observability(q))
    usable = [v for v in vectors if np.abs(v[q * m :]).max() > _EXACT]
    if len(usable) <= which:
        found = f"there are {len(usable)} parity vectors of depth {q}"
        raise BadInput(
            "functional generator", found, f"take order {plant.order}, which always has one, or more outputs"
        )
    if np.max(np.abs(poles), initial=0.0) >= 1:
        raise BadInput("functional generator", f"poles {np.asarray(poles)}", "give poles inside the unit circle")
    v = usable[which].reshape(q + 1, m)
    powers = plant.observability(q).reshape(q + 1, m, plant.order)
    T = np.array([sum(v[j] @ powers[j - i] for j in range(i, q + 1)) for i in range(1, q + 1)]).reshape(q, plant.order)
    g = -np.real(np.poly(poles))[:0:-1]
    F = np.eye(q, k=-1)
    F[:, -1] += g
    K = -v[:q] - np.outer(g, v[q])
    L2 = -v[q:]
    return Luenberger(F, K, T @ plant.B - K @ plant.D, np.eye(q)[-1:], L2, -L2 @ plant.D, T)


def least_order(plant: LinearPlant) -> int:
    """The least order of a functional generator; (3.11) bounds it by the observability index."""
    for q in range(1, plant.order + 1):
        if any(np.abs(v[q * plant.sizes[1] :]).max() > _EXACT for v in null_rows(plant.observability(q))):
            return q
    raise BadInput("functional generator", "there is no parity relation", "check C and A")


def _gap(one: Array, other: Array) -> float:
    size = max(float(np.abs(one).max(initial=0.0)), float(np.abs(other).max(initial=0.0)), 1.0)
    return float(np.abs(one - other).max(initial=0.0)) / size


@native
def _sum(A: Array, B: Array, C: Array, z: Array, y: Array, u: Array, i: int) -> float:
    """Row i of A z + B y + C u."""
    total = 0.0
    for j in range(z.shape[0]):
        total += A[i, j] * z[j]
    for j in range(y.shape[0]):
        total += B[i, j] * y[j]
    for j in range(u.shape[0]):
        total += C[i, j] * u[j]
    return total


@native
def _run(
    z: Array, F: Array, K: Array, J: Array, L1: Array, L2: Array, L3: Array, u: Array, y: Array, out: Array
) -> None:
    """Equation (3.8) over rows, changing z in place."""
    after = np.empty_like(z)
    for k in range(u.shape[0]):
        for i in range(L1.shape[0]):
            out[k, i] = _sum(L1, L2, L3, z, y[k], u[k], i)
        for i in range(z.shape[0]):
            after[i] = _sum(F, K, J, z, y[k], u[k], i)
        z[:] = after
