"""Parity relations: of redundant sensors (3.12), and over time (3.14) to (3.19); detection DFD, isolation DFI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.generators.contract import Generator, windows, with_past
from detector.generators.plant import LinearPlant
from recordings import Array, BadInput


def null_rows(matrix: Array) -> Array:
    """Orthonormal rows V with V matrix = 0, (n_rows, len(matrix)); no rows where there are none."""
    from scipy.linalg import null_space

    return null_space(np.asarray(matrix, float).T).T


@dataclass(frozen=True, eq=False)
class Parity(Generator):
    """r(k) = V [Y(k) - H U(k)], equation (3.16), over `depth` + 1 readings.

    V (p, (depth + 1) m); H; M : what faults do to Y (3.14), so that V M f is the direction in which one moves r. Until
    enough readings are there the residual is zero.
    """

    V: Array
    H: Array
    M: Array
    depth: int
    sizes: tuple[int, int]

    @property
    def width(self) -> tuple[int, int, int]:
        """See `Generator.width`."""
        return *self.sizes, len(self.V)

    def initial(self) -> Array:
        """No readings yet."""
        return np.full(self.depth * sum(self.sizes), np.nan)

    def directions(self) -> Array:
        """Unit vectors (p, g) along which a constant fault of each kind moves the residual; zero where it does not."""
        faults = self.M.shape[1] // (self.depth + 1)
        moved = self.V @ self.M @ np.tile(np.eye(faults), (self.depth + 1, 1))
        return moved / np.maximum(np.linalg.norm(moved, axis=0), 1e-12)

    def detectable(self) -> Array:
        """Whether V M is not zero (3.19), for each fault (g,)."""
        faults = self.M.shape[1] // (self.depth + 1)
        parts = np.abs(self.V @ self.M).reshape(len(self.V), self.depth + 1, faults)
        return parts.max(axis=(0, 1)) > 1e-9

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        joined, state = with_past(state, np.hstack([y, u]), self.depth)
        windowed, m = windows(joined, self.depth), self.sizes[1]
        Y, U = windowed[:, :, :m].reshape(len(y), -1), windowed[:, :, m:].reshape(len(y), -1)
        return state, np.nan_to_num((Y - U @ self.H.T) @ self.V.T)


def temporal(plant: LinearPlant, depth: int) -> Parity:
    """The parity relations of a plant over `depth` steps back; V spans all of them (3.18).

    Raises BadInput when there is none; by Cayley and Hamilton there is one at the latest when depth is the order.
    """
    V = null_rows(plant.observability(depth))
    if not len(V):
        found = f"there is no parity relation over {depth} steps"
        raise BadInput("parity relations", found, f"take a depth up to {plant.order}")
    H, M = _markov(plant, plant.B, plant.D, depth), _markov(plant, plant.R1, plant.R2, depth)
    return Parity(V, H, M, depth, plant.sizes[:2])


def static(C: Array) -> Parity:
    """Parity of redundant sensors y = C x + f (3.12): V C = 0, and the columns of V are the signature directions.

    Raises BadInput when there are no more sensors than quantities.
    """
    C = np.atleast_2d(np.asarray(C, float))
    V = null_rows(C)
    if not len(V) or np.linalg.matrix_rank(C) < C.shape[1]:
        raise BadInput("parity of sensors", f"C is {C.shape}", "give more sensors than quantities, and rank(C) = n")
    return Parity(V, np.zeros((len(C), 0)), np.eye(len(C)), 0, (0, len(C)))


def dfd(residuals: Array) -> Array:
    """Detection function r' r (n,)."""
    return np.einsum("ki,ki->k", residuals, residuals)


def dfi(residuals: Array, directions: Array) -> Array:
    """Isolation functions v_i' r (n, g), of unit directions (p, g), without sign: the largest names the fault."""
    return np.abs(residuals @ directions)


def _markov(plant: LinearPlant, into: Array, through: Array, depth: int) -> Array:
    """H of (3.14) for B, D; M for R1, R2."""
    m, r = plant.sizes[1], into.shape[1]
    block, powers = np.zeros(((depth + 1) * m, (depth + 1) * r)), plant.observability(depth).reshape(depth + 1, m, -1)
    for row in range(depth + 1):
        for column in range(row + 1):
            part = through if row == column else powers[row - column - 1] @ into
            block[row * m : (row + 1) * m, column * r : (column + 1) * r] = part
    return block
