"""A fit as a value: how it ended, in words, and the parameters."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import HOPELESS, Estimate, converged
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.estimators.noise_aware.resolution import resolved_by_nodes
from identification.estimators.order import Order
from identification.estimators.output_error.descent import Minimum
from identification.estimators.output_error.problem import Problem
from identification.estimators.output_error.replicates import Replicates
from recordings import Array
from simulator import Kernel

FREE_STEP = 2.5e-4
"""Largest sub-step of the free runs of a noise-aware fit [s]."""


class Outcome(Enum):
    """How a fit ended, with a sentence each."""

    CONVERGED = "the fit converged"
    NOT_SETTLED = "the fit ran out of iterations before it settled; take the values as approximate"
    OUT_OF_TIME = "the time allowed was over before the fit had ended; take the values as approximate, or allow more"
    NOT_CONVERGED = (
        "the fit did not converge: what it leaves does not look like noise; take the values as approximate, and no "
        "interval for granted"
    )
    NO_MOTION = "the valve does not move in these recordings; excite it over a good part of its stroke"
    CONSTANT_INPUT = "the force is constant in these recordings; nothing can be learned from it"
    NO_FRICTION = "the motion never reverses; friction cannot be told from the spring's preload: record reversals"
    TOO_SHORT = "there are too few samples for the number of parameters; record longer"
    DIVERGED = "the simulation diverged from every start; check units and signs of force and position"
    NOT_EXPLAINED = "no start led to a model that follows the data; check units, signs and roles of force and position"

    @property
    def usable(self) -> bool:
        """Whether there are parameter values to report."""
        return self.name in ("CONVERGED", "NOT_SETTLED", "OUT_OF_TIME", "NOT_CONVERGED", "NOT_EXPLAINED")


@dataclass(frozen=True)
class Fit:
    """A fit as a value.

    outcome : how it ended; ask ``outcome.usable`` before the values; kernel, coordinates : the model and what was free;
    problem, minimum : the free runs that were fitted and where that ended, None where nothing could be; rms :
    normalised root mean square residual (of the innovations where the force is estimated), 1 at the noise floor;
    estimate : force, motion and parameters as estimated together, where the fit is noise-aware, and noise_aware : what
    estimated them; replicates : of a fit in windows; order : what of the model the sampling resolves; systematic
    (n_free,) : standard errors beside the noise, in coordinates, of a noise-aware fit.
    """

    outcome: Outcome
    kernel: Kernel
    coordinates: Coordinates
    problem: Problem | None = None
    minimum: Minimum | None = None
    rms: float = float("nan")
    estimate: Estimate | None = None
    noise_aware: NoiseAware | None = None
    replicates: Replicates | None = None
    order: Order = "full"
    systematic: Array | None = None

    @property
    def estimator(self) -> str:
        """Which estimator made the fit."""
        return "output-error" if self.estimate is None else "noise-aware"

    @property
    def smooths_force(self) -> bool:
        """Whether its free runs take the force smoothed along with the motion: it is noisy, or the order is reduced."""
        return self.estimate is not None or self.order != "full"

    @property
    def p(self) -> Array:
        """The parameters (n_parameters,) in the order of the kernel, SI units."""
        assert self.minimum is not None
        return self.coordinates.p(self.minimum.unknowns[: self.coordinates.n_free])

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by full name, SI units."""
        return dict(zip(self.kernel.parameters, self.p.tolist(), strict=True))


def held(found: Fit) -> dict[str, float]:
    """The parameters that a fit held, by full name."""
    c = found.coordinates
    return {n: v for n, v, free in zip(c.names, c.base.tolist(), c.free, strict=True) if not free}


def fit_of(estimate: Estimate, work: NoiseAware, problem: Problem, minimum: Minimum) -> Fit:
    """A noise-aware estimate as a fit, with its outcome; work : what made it; problem, minimum : it as a free run."""
    resolved = resolved_by_nodes(problem.coordinates.values(estimate.theta), problem.spacing)
    outcome = Outcome.CONVERGED if converged(estimate, resolved=resolved) else Outcome.NOT_CONVERGED
    if estimate.loss > HOPELESS:
        outcome = Outcome.NOT_EXPLAINED
    rms = float(np.sqrt(estimate.loss))
    return Fit(outcome, problem.kernel, problem.coordinates, problem, minimum, rms, estimate, work)


def free_run_start(problem: Problem, estimate: Estimate) -> Array:
    """Unknowns of free runs that start where the smoothed paths do."""
    local = [
        path[0, problem.local] / problem.local_scale(piece)
        for piece, path in zip(problem.pieces, estimate.paths, strict=True)
    ]
    return np.concatenate([estimate.theta, *local])


EXPLAINED, CHANCE = 1.5, 10.0
"""How many times the loss of a right model free runs, whole or in windows, may leave and count as converged; and what
chance adds to a mean square residual, times the square root of the number of samples: for the scatter of these and of
the estimated noise."""


def fit_of_windows(problem: Problem, minimum: Minimum, usual: Replicates | None) -> Fit:
    """A fit of runs that are set back to the data in windows, with its outcome by their robust loss."""
    outcome = Outcome.CONVERGED if minimum.settled else Outcome.NOT_SETTLED
    if usual is None or minimum.level > EXPLAINED * usual.level:
        outcome = Outcome.NOT_CONVERGED
    if minimum.level > HOPELESS:
        outcome = Outcome.NOT_EXPLAINED
    rms = float(np.sqrt(minimum.level / (1.0 if usual is None else usual.level)))
    return Fit(outcome, problem.kernel, problem.coordinates, problem, minimum, rms, replicates=usual)


def fit_of_free_runs(valve: Kernel, coordinates: Coordinates, problem: Problem, minimum: Minimum | None) -> Fit:
    """A fit with its outcome: whether anything was found, whether it settled, and whether it explains the data. Runs
    that are set back begin with errors of their own, and an imposed motion leaves more than the noise of its force: how
    little a right model leaves is only known of free runs.
    """
    if minimum is None:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    square, level = 0.0, 0.0
    for i, response in enumerate(problem.responses(minimum.unknowns, minimum.setting)):
        if response is None:
            return Fit(Outcome.DIVERGED, valve, coordinates)
        segment, noise = problem.pieces[i].segment, problem.pieces[i].noise
        measured = segment.y if valve.causality == "force" else segment.u
        square += float(np.sum(problem.residual(i, response) ** 2))
        level += float(np.sum(((measured - measured.mean()) / noise)[segment.seen] ** 2))
    outcome = Outcome.CONVERGED if minimum.settled else Outcome.NOT_SETTLED
    is_free = valve.causality == "force" and np.isinf(minimum.setting.window)
    if is_free and square > (EXPLAINED + CHANCE / np.sqrt(problem.samples)) * problem.samples:
        outcome = Outcome.NOT_CONVERGED
    if square > 0.5 * level:
        outcome = Outcome.NOT_EXPLAINED
    return Fit(outcome, valve, coordinates, problem, minimum, float(np.sqrt(square / problem.samples)))
