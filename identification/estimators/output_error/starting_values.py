"""Starting values from the inverse equation: the force that the measured motion takes, fitted from several starts.

The force predicted from measured motion is almost linear in the parameters and has no stick-slip timing in it, so it
has a wide basin; its estimates are biased by the smoothing, and good enough for the descent that follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.data.experiment import Experiment, imposed
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import Normal, Solution, minimise
from identification.estimators.output_error.problem import Problem, ResidualForm
from recordings import Array
from simulator import Kernel, kernel, shows_imposed, usual_damping

STIFFNESS_STARTS = (3e5, 2e6, 8e6)
"""Bristle stiffnesses to start from [N/m]."""
STRIBECK_STARTS = (1.5e-3, 6e-3)
"""Stribeck velocities to start from [m/s]."""
PRIOR_STD = {"mass.m": 1.0, "spring.K": 1.0, "spring.F0": 10.0, "lugre.fc": 0.7, "lugre.fs": 0.7, "lugre.vs": 1.0,
         "lugre.sigma0": 1.5, "lugre.sigma1": 1.5, "lugre.sigma2": 1.5}  # fmt: skip
"""Standard deviations of the weak priors on the coordinates (logarithms) about a start."""

FORCE_ERROR = 0.02
"""Error of a predicted force, relative to the standard deviation of the measured one, that a start may have."""


@dataclass(frozen=True)
class StartingPoint:
    """Starting values: theta (n_free,) and its cost, smaller is better."""

    theta: Array
    cost: float


def starting_values(experiments: Sequence[Experiment], valve: Kernel, coordinates: Coordinates) -> list[StartingPoint]:
    """Starting values for a fit, best first. Empty when nothing moves. Effects that have no part in the force of an
    imposed motion start from what they are by default.
    """
    rough = regression(experiments, coordinates.held("spring.K"))
    if rough is None:
        return []
    effects = [effect for effect in valve.effects if shows_imposed(valve.catalogue[effect])]
    inverse = kernel(effects, "motion", valve.catalogue)
    own = coordinates.part(inverse.parameters)
    driven = [imposed(e) for e in experiments]
    force_std = float(np.std(np.concatenate([s.u for e in driven for s in e.segments]))) or 1.0
    problem = Problem(inverse, own, [replace(e, noise_force=FORCE_ERROR * force_std) for e in driven])
    prior = precision(own, PRIOR_STD)
    found = []
    for stiffness in STIFFNESS_STARTS:
        for stribeck in STRIBECK_STARTS:
            first = own.theta(_assembled(own, rough, stiffness, stribeck, force_std))
            end = _fitted(problem, first, prior)
            if end is not None:
                values = coordinates.defaults | own.values(end.theta[: len(first)])
                found.append(StartingPoint(coordinates.theta_of(values), end.normal.cost))
    return sorted(found, key=lambda s: s.cost)


def _fitted(problem: Problem, theta: Array, prior: Array) -> Solution | None:
    setting = ResidualForm(0.0, tuning=0.5)
    unknowns = problem.start(theta)
    wide = np.concatenate([prior, np.zeros(len(unknowns) - len(theta))])

    def evaluate(x: Array) -> Normal | None:
        normal = problem.evaluate(x, setting)
        return None if normal is None else normal.with_prior(x, unknowns, wide)

    bounds = problem.coordinates.bounds.padded(len(unknowns))
    return minimise(evaluate, unknowns, bounds=bounds, iterations=12, tolerance=1e-3)


def precision(coordinates: Coordinates, std: dict[str, float], default: float = 1.0) -> Array:
    """Prior precisions (n_free,) from standard deviations by parameter name."""
    names = coordinates.free_names
    return np.array([std.get(name, default) ** -2 for name in names])


def regression(experiments: Sequence[Experiment], stiffness: float | None = None) -> dict[str, float] | None:
    """Mass, spring, preload, Coulomb and viscous friction by robust regression of the force on the moving samples.

    stiffness : of the spring [N/m] where it is known; with a position that is counted from far away the force would
    otherwise be shared out between spring and preload at will. None when the valve moves in fewer than 20 samples.
    """
    parts = [(s.motion, s.u) for e in experiments for s in e.segments]
    x, v, a, crept = (np.concatenate([getattr(m, k) for m, _ in parts]) for k in ("x", "v", "a", "crept"))
    u = np.concatenate([force for _, force in parts])
    moving = np.abs(crept) > 0
    if moving.sum() < 20:
        return None
    spring = x if stiffness is None else np.zeros_like(x)
    u = u if stiffness is None else u - stiffness * x
    table = np.column_stack([a, spring, np.ones_like(x), np.sign(crept), v])[moving]
    norm = np.linalg.norm(table, axis=0)
    table, force = table / np.where(norm > 0, norm, 1.0), u[moving]
    solution = np.linalg.lstsq(table, force, rcond=None)[0]
    for _ in range(15):
        error = force - table @ solution
        spread = 1.48 * float(np.median(np.abs(error))) or 1.0
        weight = 1.0 / np.sqrt(1.0 + (error / (2 * spread)) ** 2)
        solution = np.linalg.lstsq(table * weight[:, None], force * weight, rcond=None)[0]
    return dict(zip(("m", "K", "F0", "fc", "sigma2"), (solution / np.where(norm > 0, norm, 1.0)).tolist(), strict=True))


def _assembled(c: Coordinates, rough: dict[str, float], stiffness: float, stribeck: float, force_std: float) -> Array:
    """A full parameter vector from the regression, with what it cannot know filled in."""
    mass = rough["m"] if rough["m"] > 0.3 else 3.0
    coulomb = max(rough["fc"], 1e-3 * force_std)
    values = {
        "mass.m": mass, "spring.K": max(rough["K"], 1.0), "spring.F0": rough["F0"], "lugre.fc": coulomb,
        "lugre.fs": 1.3 * coulomb, "lugre.vs": stribeck, "lugre.sigma0": stiffness,
        "lugre.sigma1": usual_damping(stiffness, mass), "lugre.sigma2": max(rough["sigma2"], 10.0),
    }  # fmt: skip
    known = c.defaults | {name: value for name, value in values.items() if c.is_free(name)}
    return np.array([known[name] for name in c.names])
