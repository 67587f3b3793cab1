"""Basin search: other friction curves and bristles, judged by the cheap first stage of the homotopy.

After the first stage mass, spring, Coulomb and viscous friction are nearly always right; what a wrong basin has wrong
is the shape of the Stribeck curve or the bristle, and the first stage's cost tells.
"""

from __future__ import annotations

from identification.budget import time_is_over
from identification.estimators.output_error.homotopy import Homotopy
from recordings import Array

BETTER = 0.95
"""A change is kept when it brings the cost below this share of what it was."""
ROUNDS = 2


def changes(values: dict[str, float]) -> list[dict[str, float]]:
    """Other values worth trying, by parameter name."""
    curves = [{"lugre.fs": 1.4 * values["lugre.fc"], "lugre.vs": vs} for vs in (1e-3, 3e-3, 1e-2)]
    damped = [{"lugre.sigma1": share * values["lugre.sigma1"]} for share in (0.1, 0.3)]
    stiff = [{"lugre.sigma0": share * values["lugre.sigma0"]} for share in (3.0, 0.3)]
    return curves + damped + stiff


def basin_search(theta: Array, homotopy: Homotopy) -> Array | None:
    """Greedy search over `changes`, each followed by the first stage. theta (n_free,) in and out."""
    coordinates, n = homotopy.full.coordinates, homotopy.full.n_free
    best = homotopy.first(theta)
    if best is None or "lugre.vs" not in coordinates.names:
        return None if best is None else best.theta[:n]
    for _ in range(ROUNDS):
        before = best.normal.cost
        values = coordinates.values(best.theta[:n])
        for change in changes(values):
            if time_is_over():
                return best.theta[:n]
            end = homotopy.first(coordinates.theta_of(values | change))
            if end is not None and end.normal.cost < BETTER * best.normal.cost:
                best = end
                values = coordinates.values(best.theta[:n])
        if best.normal.cost >= BETTER * before:
            break
    return best.theta[:n]
