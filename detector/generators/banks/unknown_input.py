"""Unknown-input observers: residuals that known directions of disturbance or of a fault cannot move (3.2.2)."""

from __future__ import annotations

import numpy as np

from detector.generators.luenberger import Luenberger
from detector.generators.parity import null_rows
from detector.generators.plant import LinearPlant
from recordings import Array, BadInput

_EXACT = 1e-9


def unknown_input(plant: LinearPlant, into: Array, through: Array | None = None, speed: float = 1.0) -> Luenberger:
    """A generator (3.8), with the conditions (3.9), whose residuals d cannot move: x(k+1) = A x + B u + E d,
    y = C x + D u + G d, d (q,) unknown.

    into : E (n, q); through : G (m, q), zero where not given. Without G: T = I - H C with H = E (C E)^+, so T E = 0.
    With G of rank q: d = G^+ (y - C x - D u) is put into the state equation, and rows N with N G = 0 remain of the
    outputs. speed : how fast the observer is, variance of the process over that of the measurements.
    Raises BadInput where neither form exists: no reading shows d at once or one step later apart from what is left to
    judge by; and where what d hides is not detectable.

    After Chen, Patton and Zhang, Int. J. Control 63(1), 1996, and Hou and Mueller, IEEE TAC 37(6), 1992.
    """
    E = np.atleast_2d(np.asarray(into, float))
    G = np.zeros((plant.sizes[1], E.shape[1])) if through is None else np.atleast_2d(np.asarray(through, float))
    if E.shape[0] != plant.order or G.shape != (plant.sizes[1], E.shape[1]):
        found = f"E is {E.shape} and G is {G.shape}"
        raise BadInput("unknown-input observer", found, f"give ({plant.order}, q) and ({plant.sizes[1]}, q)")
    return _at_once(plant, E, G, speed) if np.abs(G).max(initial=0.0) > _EXACT else _later(plant, E, speed)


def _later(plant: LinearPlant, E: Array, speed: float) -> Luenberger:
    C, q = plant.C, np.linalg.matrix_rank(E)
    if np.linalg.matrix_rank(C @ E) < q:
        found = f"C E has rank {np.linalg.matrix_rank(C @ E)}, E has rank {q}"
        raise BadInput("unknown-input observer", found, "measure what the unknown input moves first")
    H = E @ np.linalg.pinv(C @ E)
    T = np.eye(plant.order) - H @ C
    gain = _gain(T @ plant.A, C, speed)
    F = T @ plant.A - gain @ C
    K = gain + F @ H
    L2 = np.eye(len(C)) - C @ H
    return Luenberger(F, K, T @ plant.B - K @ plant.D, -C, L2, -L2 @ plant.D, T)


def _at_once(plant: LinearPlant, E: Array, G: Array, speed: float) -> Luenberger:
    if np.linalg.matrix_rank(G) < G.shape[1] or not len(null_rows(G)):
        found = f"G {G.shape} has rank {np.linalg.matrix_rank(G)}"
        raise BadInput("unknown-input observer", found, "give more outputs than unknown inputs, each of which shows")
    N, known = null_rows(G), E @ np.linalg.pinv(G)
    A, C = plant.A - known @ plant.C, N @ plant.C
    gain = _gain(A, C, speed)
    K = known + gain @ N
    return Luenberger(A - gain @ C, K, plant.B - K @ plant.D, -C, N, -N @ plant.D, np.eye(plant.order))


def _gain(A: Array, C: Array, speed: float) -> Array:
    """A stable observer of what is detectable: the Riccati equation's."""
    from scipy.linalg import solve_discrete_are

    try:
        P = solve_discrete_are(A.T, C.T, speed * np.eye(len(A)), np.eye(len(C)))
    except (np.linalg.LinAlgError, ValueError):
        raise BadInput(
            "unknown-input observer", "what the unknown input hides is not detectable", "decouple less"
        ) from None
    gain = np.asarray(np.linalg.solve(C @ P @ C.T + np.eye(len(C)), C @ P @ A.T).T, np.float64)
    if np.max(np.abs(np.linalg.eigvals(A - gain @ C))) >= 1:
        raise BadInput("unknown-input observer", "what the unknown input hides is not detectable", "decouple less")
    return gain
