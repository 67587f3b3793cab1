"""How far a noise-aware fit may be off beside its noise, and what of that is known.

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
from identification.estimators.fitted import Fit
from identification.estimators.noise_aware.best_paths import noise_aware_for
from identification.estimators.noise_aware.search import WholeFit
from identification.estimators.output_error.replicates import without_noise
from recordings import Array


def without_bias(found: Fit, whole: WholeFit) -> Fit:
    """A noise-aware fit to whole recordings less its bias, with `Fit.systematic`, how far it may be off beside its
    noise; its estimate stays as it was.
    """
    assert found.estimate is not None
    left = found.estimate.covariance @ found.estimate.normal.gradient
    bias = order_bias(found)
    causes = left, whole.to_others, whole.to_rougher, np.zeros_like(left) if bias is None else bias
    found = replace(found, systematic=np.sqrt(np.sum(np.square(causes), axis=0)))
    return found if bias is None else _less(found, bias)


def in_doubt_by(found: Fit, other: Array) -> Fit:
    """A fit whose intervals hold another estimate of its parameters (m,), in coordinates, too: how far that is away is
    one more standard error beside the noise.
    """
    assert found.minimum is not None
    away = np.abs(found.minimum.unknowns[: len(other)] - other)
    before = np.zeros_like(away) if found.systematic is None else found.systematic
    return replace(found, systematic=np.hypot(before, away))


def order_bias(found: Fit) -> Array | None:
    """Where the next step of a noise-aware fit goes from its end (m,), in coordinates, on what the model gives there in
    full order and fine steps; None where that has no solution.
    """
    problem, estimate = found.problem, found.estimate
    assert problem is not None
    assert estimate is not None
    experiments = without_noise(problem, estimate.theta)
    if experiments is None:
        return None
    coordinates = problem.coordinates.with_priors_at(estimate.theta)  # to a replicate what is known beforehand is right
    work = noise_aware_for(problem.kernel, coordinates, grids(experiments), [estimate.theta], found.order)
    start = work.start(estimate.theta)
    return None if start is None else work.step(start)


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
