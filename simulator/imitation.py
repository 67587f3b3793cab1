"""How a model without an effect imitates it, for effects that do it alike: what their fits have to start from."""

from __future__ import annotations

from collections.abc import Mapping

SHARES = (0.3, 0.6, 0.9)
"""Shares of what a model can have bent that are tried."""
LEAST = 0.1
"""Share of a parameter that is left to it whatever an effect takes."""


def late(name: str, base: Mapping[str, float]) -> list[dict[str, float]]:
    """Starts for a lag `name` [s] between force and position.

    To first order a lag tau is the operator 1 + tau d/dt on all forces: K x becomes K x + tau K v, and likewise up the
    orders. So a model without it has sigma2 + tau K for viscous friction, m + tau sigma2 for mass and
    sigma1 + tau sigma0 for the damping of the bristle, and only the third order is left over.
    """
    K, sigma2, m = base["spring.K"], base["lugre.sigma2"], base["mass.m"]
    sigma0, sigma1 = base["lugre.sigma0"], base["lugre.sigma1"]
    found = []
    for share in SHARES if K > 0 else ():
        tau = share * sigma2 / K
        own = (1 - share) * sigma2
        found.append({
            name: tau, "lugre.sigma2": own, "mass.m": max(m - tau * own, LEAST * m),
            "lugre.sigma1": max(sigma1 - tau * sigma0, LEAST * sigma1),
        })  # fmt: skip
    return found


def hidden_in_friction(name: str, base: Mapping[str, float], share: float) -> dict[str, float]:
    """A start for a hysteresis of the force `name` [N] that is a share of Coulomb friction: once its branches are run
    through it is a constant friction, so a model without it has that much more of fc and fs.
    """
    part = share * base["lugre.fc"]
    return {name: part, "lugre.fc": base["lugre.fc"] - part, "lugre.fs": base["lugre.fs"] - part}
