"""A force-driven fit where the recorded force is noisy: when it is needed, and how it is made of its parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.data.experiment import Experiment
from identification.estimators.coordinates import Coordinates
from identification.estimators.noise_aware.estimator import Estimate, NoiseAware, grids, resolving
from identification.estimators.noise_aware.linearised_model import Grid
from identification.estimators.noise_aware.search import UNEXPLAINED, fit_noise_aware, on_chunks, sought
from identification.estimators.output_error.basin_search import shaken
from identification.estimators.output_error.homotopy import Homotopy, Path
from identification.estimators.output_error.problem import Problem, Setting
from identification.estimators.starting_values import regression, starts
from recordings import Array
from simulator import Kernel, kernel

MATTERS = 3e-4
"""Noise of the force, as a share of Coulomb friction, from which it is not neglected. Noise shakes the simulated
bristle by its share of the break-away deflection in every sample, and 0.2 % of it spoils break-away force by 30 %."""
WAYS_LOOSE = 3
"""Ways that are gone with freedom paths for a start of free runs, at most."""
RESOLVED = 1.0
"""`turn` up to which the sampling resolves break-away where the force is noisy."""
FREE_STEP = 2.5e-4
"""Sub-step of free runs [s]."""


@dataclass(frozen=True)
class NoiseAwareFit:
    """estimate: of parameters and paths; problem, path : the same end as a free run on the smoothed force."""

    estimate: Estimate
    problem: Problem
    path: Path


def force_noise_matters(experiments: Sequence[Experiment]) -> bool:
    """Whether the noise of the recorded force is large enough to shake a simulated bristle."""
    guess = regression(experiments)
    noise = max(e.noise_force for e in experiments)
    return guess is not None and noise > MATTERS * abs(guess["fc"])


def with_smooth_force(experiments: Sequence[Experiment], seen: Sequence[Grid] | None = None) -> list[Experiment]:
    """The experiments with their force smoothed; seen : their grids, where they are at hand."""
    left = iter(grids(experiments) if seen is None else seen)
    found = []
    for e in experiments:
        pairs = [(s, next(left)) for s in e.segments]
        smooth = [replace(s, u=np.interp(s.t, grid.t, grid.free_force)) for s, grid in pairs]
        found.append(e.with_segments(tuple(smooth)))
    return found


def fit_uncertain(valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment]) -> NoiseAwareFit | None:
    """Fit without start values; None where no start leads anywhere."""
    seen = grids(experiments)
    smooth = with_smooth_force(experiments, seen)
    found = first_values(valve, coordinates, smooth)
    if not found:
        return None
    estimate = estimated(valve, coordinates, found, resolving(seen, quickest(coordinates, found)))
    if estimate is None:
        return None
    problem = Problem(valve, coordinates, smooth)
    unknowns = _started(problem, estimate)
    return NoiseAwareFit(estimate, problem, Path(unknowns, estimate.normal, Setting(FREE_STEP), 0, estimate.settled))


def first_values(valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment]) -> list[Array]:
    """Start values (m,), the best first, from experiments with a smooth force; none where nothing moves."""
    ranked = starts(smooth, valve.effects, coordinates)
    if not ranked:
        return []
    first = shaken(ranked[0].theta, Homotopy(valve, coordinates, smooth))
    return [theta for theta in (first, ranked[0].theta) if theta is not None]


def loose_start(valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment]) -> Array | None:
    """Start values (m,) for a fit by free runs, from one to chunks whose paths may stray: costly, but it finds its way
    where resets to the data do not. None where it leads nowhere, as with a model that lacks something.
    """
    found = first_values(valve, coordinates, experiments)
    if not found:
        return None
    seen = resolving(grids(experiments), quickest(coordinates, found))
    whole = NoiseAware(kernel(valve.effects, "uncertain force"), coordinates, seen)
    end = sought(on_chunks(whole), *found, most=WAYS_LOOSE)
    return None if end is None or end.loss > UNEXPLAINED else end.theta


def swing(values: Mapping[str, float]) -> float:
    """Angular frequency [rad/s] of the mass on its bristles, for parameters by full name."""
    return float(np.sqrt(values["lugre.sigma0"] / values["mass.m"]))


def turn(values: Mapping[str, float], problem: Problem) -> float:
    """Angle [rad] by which the mass swings on its bristles from sample to sample, for parameters by full name."""
    return swing(values) * problem.spacing


def quickest(coordinates: Coordinates, starts: Sequence[Array]) -> float:
    """The largest `swing` of several starts: one of them may have a mass of tons."""
    return max(swing(coordinates.values(theta)) for theta in starts)


def estimated(valve: Kernel, coordinates: Coordinates, found: Sequence[Array], seen: Sequence[Grid]) -> Estimate | None:
    """Parameters and paths of grids from one start or several, the best first; None where none leads anywhere."""
    return fit_noise_aware(NoiseAware(kernel(valve.effects, "uncertain force"), coordinates, seen), *found)


def _started(problem: Problem, estimate: Estimate) -> Array:
    """Unknowns of free runs from where the estimated paths begin."""
    local = [
        path[0, problem.local] / problem.local_scale(piece)
        for piece, path in zip(problem.pieces, estimate.paths, strict=True)
    ]
    return np.concatenate([estimate.theta, *local])
