"""Structure of a neural observer by differential evolution, a genetic search (3.2.2, computational intelligence)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from detector.generators.neural.observer import NeuralObserver, learn_neural
from recordings import Array, BadInput

RANGES = {"depth": (1, 8), "hidden": (5, 160), "ridge": (-9.0, -2.0), "steepness": (-1.0, 1.0)}
"""What is searched: past readings and neurons (whole numbers), decimal logarithms of ridge and steepness."""


@dataclass(frozen=True, eq=False)
class EvolvedStructure:
    """observer : the best one, learned on all rows; depth, hidden, ridge, steepness : its structure; error : RMS of its
    residuals on rows that did not teach it, over the deviations of the outputs; tried : structures.
    """

    observer: NeuralObserver
    depth: int
    hidden: int
    ridge: float
    steepness: float
    error: float
    tried: int


def evolve_neural(u: Array, y: Array, *, generations: int = 8, population: int = 5, seed: int = 0) -> EvolvedStructure:
    """Search the structure on fault-free rows u (n, r), y (n, m): the first two thirds teach, the rest judges.

    scipy's differential evolution with whole numbers where a structure has them; the same seed gives the same answer.
    Raises BadInput for too few rows for the largest structure.
    """
    from scipy.optimize import differential_evolution

    cut = len(y) * 2 // 3
    least = 3 * (RANGES["depth"][1] * (u.shape[1] + y.shape[1] + 1) + int(RANGES["hidden"][1]))
    if cut < least:
        raise BadInput("structure search", f"{len(y)} readings", f"give at least {least * 3 // 2 + 1}")
    size = np.std(y, axis=0) + 1e-12

    def error(genes: Array) -> float:
        learned = learn_neural(u[:cut], y[:cut], **_structure(genes), seed=seed)
        judged = learned.run(learned.initial(), u[cut:], y[cut:])[1][int(RANGES["depth"][1]) :]
        return float(np.sqrt(np.mean((judged * learned.deviation / size) ** 2)))

    found = differential_evolution(
        error, list(RANGES.values()), integrality=[True, True, False, False], maxiter=generations, popsize=population,
        rng=np.random.default_rng(seed), polish=False, tol=0.0,
    )  # fmt: skip
    best = _structure(found.x)
    observer = learn_neural(u, y, **best, seed=seed)
    return EvolvedStructure(observer, **best, error=float(found.fun), tried=int(found.nfev))


def _structure(genes: Array) -> dict[str, Any]:
    depth, hidden, ridge, steepness = genes
    return {"depth": round(depth), "hidden": round(hidden), "ridge": 10.0**ridge, "steepness": 10.0**steepness}
