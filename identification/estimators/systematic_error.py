"""How far a fit of damped order may be off beside its noise, and what of that is known.

The force between and behind its samples is taken for a smooth one, and independent of the motion. A positioner answers
every slip, and a valve slips where the force bends; what smoothing leaves of that is taken for friction. A replicate
without noise has the same force, so a fit to it is off by about as much, and an estimate less that is nearer (indirect
inference: Gourieroux, Monfort and Renault, J. Appl. Econometrics 8(S1), 1993). What a replicate does not show, a fit
with a rougher force does: where that ends elsewhere, the model of the force decides (closed loops: Ljung, System
Identification, 1999, section 13.4).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.data.grid import grids
from identification.estimators.estimate import Estimate
from identification.estimators.fitted import Fit
from identification.estimators.noise_aware.damped import DampedNoiseAware, damped_for
from identification.estimators.noise_aware.damped_search import with_rougher_force
from identification.estimators.output_error.problem import Problem
from identification.estimators.output_error.replicates import replicate_of
from recordings import Array

STEPS = 4
"""Steps of a fit to a replicate."""


def without_bias(found: Fit, apart: Array | float = 0.0) -> Fit:
    """A noise-aware fit of damped order less its bias, with `Fit.systematic`, how far it may be off beside its noise;
    its estimate stays as it was. apart (m,) : distance in coordinates to another end, one cause of that.
    """
    assert found.estimate is not None
    left = found.estimate.covariance @ found.estimate.normal.gradient
    bias, rough = order_bias(found), by_rougher_force(found)
    causes = [apart * np.ones_like(left), left, *(move for move in (bias, rough) if move is not None)]
    found = replace(found, systematic=np.sqrt(np.sum(np.square(causes), axis=0)))
    return found if bias is None else _less(found, bias)


def order_bias(found: Fit) -> Array | None:
    """Where a noise-aware fit of damped order goes from its end (m,), in coordinates, on what the model gives in full
    order there; None where that has no solution.
    """
    assert found.problem is not None
    assert found.estimate is not None
    theta = found.estimate.theta
    again = fitted_to_replicate(found.problem, theta, noise=False)
    return None if again is None else again.theta - theta


def by_rougher_force(found: Fit) -> Array | None:
    """Where it goes (m,), in coordinates, if the force is rougher between samples; None where the model diverges."""
    assert found.estimate is not None
    assert isinstance(found.noise_aware, DampedNoiseAware)
    end = with_rougher_force(found.noise_aware, found.estimate)
    return None if end is None else end.theta - found.estimate.theta


def _less(found: Fit, bias: Array) -> Fit:
    """A fit whose values are less a bias (m,), in coordinates, within their bounds; with constraints of the user they
    stay where those are kept.
    """
    c, minimum = found.coordinates, found.minimum
    if minimum is None or c.constraints:
        return found
    unknowns = minimum.unknowns.copy()
    unknowns[: len(bias)] = np.clip(unknowns[: len(bias)] - bias, c.bounds.lower, c.bounds.upper)
    return replace(found, minimum=replace(minimum, unknowns=unknowns))


def fitted_to_replicate(problem: Problem, theta: Array, *, noise: bool) -> Estimate | None:
    """The estimate some steps from theta (m,) on a replicate of the experiments, to which what is known beforehand is
    right; None without a solution.
    """
    experiments = replicate_of(problem, theta, noise=noise)
    if experiments is None:
        return None
    coordinates = problem.coordinates.with_priors_at(theta)
    return damped_for(problem.kernel, coordinates, grids(experiments), theta).fit(theta, STEPS)
