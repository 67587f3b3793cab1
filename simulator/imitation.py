"""First guesses of effects that a base model imitates by bending its own parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from recordings import Array
from simulator.first_look import LEAST, FirstLook, Missing

DELAYS = tuple(float(tau) for tau in np.geomspace(5e-4, 0.3, 15))
"""Delays that are tried [s]."""
MOSTLY = 0.7
"""Share of the viscous friction that a lag has put there. Where it was 0.8, fits found the lag from 0.6 to 0.8 of it,
and neither from 0.4 nor from 0.95."""
HIDDEN = 0.3
"""Share of Coulomb friction that hides a hysteresis at most: bristles that are bent otherwise look like more of it."""
Delayed = Callable[[FirstLook, float], Array]
"""The force of a recording, so many seconds late."""


def shifted(look: FirstLook, tau: float) -> Array:
    """The force tau [s] ago."""
    return np.asarray(np.interp(look.t - tau, look.t, look.u))


def filtered(look: FirstLook, tau: float) -> Array:
    """The force behind a first-order lag tau [s]."""
    from scipy.signal import lfilter  # half of what a command's start would take, for two effects

    keep = float(np.exp(-np.median(np.diff(look.t)) / tau))
    return np.asarray(lfilter([1 - keep], [1, -keep], look.u - look.u[0])) + look.u[0]


def late(name: str, looks: Sequence[FirstLook], base: Mapping[str, float], delayed: Delayed) -> list[dict[str, float]]:
    """Guesses of a lag `name` [s] between force and position, and what the base model then has without it: the one that
    leaves least of the force when that is regressed on the motion, and, for samples far apart blur a slip in which a
    lag shows best, the one that has made most of the viscous friction.

    To first order a lag tau is the operator 1 + tau d/dt on all forces: K x becomes K x + tau K v, and likewise up the
    orders. So a model without it has sigma2 + tau K for viscous friction, m + tau sigma2 for mass and
    sigma1 + tau sigma0 for the damping of the bristle, and only the third order is left over.
    """
    if base["spring.K"] <= 0:
        return []
    tried = [(tau, _beside(delayed, tau, looks, base)) for tau in DELAYS]
    tau, least = min(tried, key=lambda one: one[1].unexplained)
    own = least.alone
    sigma1 = max(base["lugre.sigma1"] - tau * base["lugre.sigma0"], LEAST * base["lugre.sigma1"])
    regressed = {name: tau, "lugre.sigma2": own["lugre.sigma2"], "mass.m": own["mass.m"], "lugre.sigma1": sigma1}
    return [regressed, _mostly_lag(name, base)]


def _mostly_lag(name: str, base: Mapping[str, float]) -> dict[str, float]:
    """The lag that has made most of the viscous friction, and what the base model has without it."""
    sigma2, tau = (1 - MOSTLY) * base["lugre.sigma2"], MOSTLY * base["lugre.sigma2"] / base["spring.K"]
    m = max(base["mass.m"] - tau * sigma2, LEAST * base["mass.m"])
    sigma1 = usual_damping(base["lugre.sigma0"], m)  # what the lag has done to it nobody can tell
    return {name: tau, "lugre.sigma2": sigma2, "mass.m": m, "lugre.sigma1": sigma1}


def usual_damping(sigma0: float, m: float) -> float:
    """Damping of a bristle [N s/m] to begin with where nothing tells it, of a stiffness [N/m] and with a mass [kg]: a
    quarter of critical damping.
    """
    return float(0.5 * (sigma0 * m) ** 0.5)


def hidden_in_friction(name: str, force: float, base: Mapping[str, float]) -> dict[str, float]:
    """A hysteresis of the force that is `name` wide, and the friction beside it [N]: once its branches are run through
    it is a constant friction, so a model without it has that much more of fc and fs. force : as it seems [N].
    """
    part = min(force, HIDDEN * base["lugre.fc"])
    return {name: part, "lugre.fc": base["lugre.fc"] - part, "lugre.fs": base["lugre.fs"] - part}


def _beside(delayed: Delayed, tau: float, looks: Sequence[FirstLook], base: Mapping[str, float]) -> Missing:
    """What is missing when the force is so late."""
    return Missing.of([replace(look, u=delayed(look, tau)) for look in looks], base)
