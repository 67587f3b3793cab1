"""A linear plant learned from fault-free readings, for the linear generators: an ARX model in observer form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from detector.evaluation.benchmark.runs import CV, P1, P2, F, X
from detector.generators.plant import LinearPlant
from recordings import Array

_DEPTH = 3


@dataclass(frozen=True, eq=False)
class Linearised:
    """plant : from CV and the pressure drop to X and F, with faults: sensor of X, sensor of F, set point; means of
    inputs and outputs.
    """

    plant: LinearPlant
    u_mean: Array
    y_mean: Array

    def inputs(self, run: Array) -> Array:
        """Inputs (n, 2) of the plant."""
        return inputs(run) - self.u_mean

    def outputs(self, run: Array) -> Array:
        """Outputs (n, 2): X, and F limited to where its transmitter is not saturated."""
        return outputs(run) - self.y_mean


def inputs(run: Array) -> Array:
    """CV and the pressure drop (n, 2)."""
    return np.column_stack([run[:, CV], run[:, P1] - run[:, P2]])


def outputs(run: Array) -> Array:
    """X, and F limited to where its transmitter is not saturated (n, 2)."""
    return np.column_stack([run[:, X], np.clip(run[:, F], 0.02, 0.95)])


def linearise(run: Array) -> Linearised:
    """Least squares on a fault-free run (n, 6): each output from its own last readings and the inputs."""
    u, y = inputs(run), outputs(run)
    u_mean, y_mean = u.mean(axis=0), y.mean(axis=0)
    blocks = []
    for place in range(y.shape[1]):
        past, target = _rows(u - u_mean, y[:, place] - y_mean[place])
        blocks.append(np.asarray(np.linalg.lstsq(past, target, rcond=None)[0], np.float64))
    return Linearised(_stacked(blocks, u.shape[1]), u_mean, y_mean)


def _rows(u: Array, y: Array) -> tuple[Array, Array]:
    """Past outputs, then past inputs of lags 1 to depth; and the outputs they lead to."""
    n = len(y) - _DEPTH
    outputs = [y[_DEPTH - lag : _DEPTH - lag + n] for lag in range(1, _DEPTH + 1)]
    inputs = [u[_DEPTH - lag + 1 : _DEPTH - lag + 1 + n] for lag in range(1, _DEPTH + 1)]
    return np.column_stack([*outputs, *inputs]), y[_DEPTH:]


def _stacked(blocks: list[Array], r: int) -> LinearPlant:
    """The models in observer form, one below the other.

    y(k) = x1(k) + b1 u(k), x_i(k+1) = x_(i+1)(k) + a_i y(k) + b_(i+1) u(k): the present input acts within its second.
    """
    n, m = _DEPTH, len(blocks)
    A, B, C = np.zeros((n * m, n * m)), np.zeros((n * m, r)), np.zeros((m, n * m))
    D = np.zeros((m, r))
    for i, solved in enumerate(blocks):
        at = slice(i * n, (i + 1) * n)
        A[at, at] = np.eye(n, k=1)
        A[at, i * n] += solved[:n]
        b = np.vstack([solved[n:].reshape(n, r), np.zeros((1, r))])
        B[at], C[i, i * n], D[i] = b[1:] + np.outer(solved[:n], b[0]), 1.0, b[0]
    R1, R2 = np.hstack([np.zeros((n * m, m)), B[:, :1]]), np.hstack([np.eye(m), D[:, :1]])
    return LinearPlant(A, B, C, D, R1, R2)
