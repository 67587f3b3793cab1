"""What a right model would leave, and where its fit would go: replicates of the recordings, given by the fit itself.

The fitted valve is run in full order and fine steps on the smoothed force, noise of the estimated size is added to
position and force, and a few steps of the fit are made on each replicate from the fitted parameters. What they have in
common is bias, of the damped order, of smoothing, of setting back and of a force that bends between samples; what they
have not is noise. Both belong to an interval (a parametric bootstrap of few steps: Davidson and MacKinnon,
International Economic Review 40(2), 1999).
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from identification.data.experiment import Experiment, Segment, noisy
from identification.data.grid import with_smooth_force
from identification.data.smoothing import Motion
from identification.estimators.least_squares import Normal, minimise
from identification.estimators.order import swing
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.priors import UNRESOLVED, prior
from recordings import Array
from simulator import kernel

FINE, FINEST = 0.3, 4e-5
"""Angle [rad] by which the mass swings on its bristles in a sub-step of a replicate, and its shortest sub-step [s]."""
STEPS = 4
"""Steps of the fit on a replicate."""
BETWEEN = 4
"""Parts of the time between samples in which the force of a replicate bends."""


@dataclass(frozen=True)
class Replicates:
    """moves (n_trials, n_free): where the fit goes on each replicate, in coordinates; levels (n_trials,): the robust
    loss of a sample that is left there.
    """

    moves: Array
    levels: Array

    @property
    def level(self) -> float:
        """The loss that a right model leaves."""
        return float(np.mean(self.levels))


def replicates(
    problem: Problem,
    unknowns: Array,
    form: ResidualForm,
    trials: int,
    *,
    steps: int = STEPS,
    seed: int = 0,
) -> Replicates | None:
    """So many replicates of the fit of a damped problem that ended at `unknowns`, each fitted in so many steps.

    None where the model diverges in full order.
    """
    rng, theta = np.random.default_rng(seed), unknowns[: problem.n_free]
    predicted = _in_full_order(problem, theta)
    if predicted is None:
        return None
    bounds = problem.coordinates.bounds.padded(len(unknowns))
    moves, levels = [], []
    for _ in range(trials):
        coordinates = problem.coordinates.with_drawn_priors(theta, rng)
        again = with_smooth_force(_drawn(problem.experiments, predicted, rng))
        drawn = Problem(problem.kernel, coordinates, again)
        evaluate = functools.partial(in_windows, drawn, form)
        end = minimise(evaluate, drawn.start(theta), bounds=bounds, iterations=steps, tolerance=0.0)
        if end is not None:
            moves.append(end.theta[: len(theta)] - theta)
            levels.append(end.normal.cost / drawn.samples)
    return Replicates(np.array(moves), np.array(levels)) if moves else None


def without_noise(problem: Problem, theta: Array) -> list[Experiment] | None:
    """The experiments as the valve of theta (n_free,) would have given them in full order without noise: what a fit to
    them differs from theta by is the bias of its order. None where the model diverges.
    """
    predicted = _in_full_order(problem, theta)
    return None if predicted is None else _drawn(problem.experiments, predicted, None)


def _in_full_order(problem: Problem, theta: Array) -> list[Array] | None:
    """The positions (n_samples,) of each segment by free runs in full order and fine steps; None where they diverge."""
    full = kernel(problem.kernel.effects, "force", problem.kernel.catalogue)
    curved = Problem(full, problem.coordinates, [_curved(e) for e in problem.experiments])
    answers = curved.responses(curved.start(theta), following(problem.coordinates.values(theta)))
    predicted = [answer.predicted[::BETWEEN] for answer in answers if answer is not None]
    return predicted if len(predicted) == len(answers) else None


def following(values: Mapping[str, float]) -> ResidualForm:
    """Free runs in steps that follow the swing of the mass on its bristles, for parameters by full name."""
    return ResidualForm(max(FINE / swing(values), FINEST))


def _curved(e: Experiment) -> Experiment:
    """The experiment with a force that bends between the samples, where a fit takes it for straight."""
    return e.with_segments(tuple(_finer(s) for s in e.segments))


def _finer(s: Segment) -> Segment:
    n, m = len(s.t), s.motion
    t = np.interp(np.arange((n - 1) * BETWEEN + 1) / BETWEEN, np.arange(n), s.t)
    y, load, x, v, a, crept = (np.interp(t, s.t, z) for z in (s.y, s.load, m.x, m.v, m.a, m.crept))
    return Segment(t, PchipInterpolator(s.t, s.u)(t), y, np.ones(len(t), bool), Motion(x, v, a, crept), load)


def in_windows(problem: Problem, form: ResidualForm, unknowns: Array) -> Normal | None:
    """The normal equations of a damped problem, with what is known of friction beforehand; None where it diverges."""
    normal, c = problem.evaluate(unknowns, form), problem.coordinates
    return None if normal is None else normal.plus(prior(c.free_names, unknowns[: c.n_free], UNRESOLVED))


def _drawn(
    experiments: Sequence[Experiment], predicted: Sequence[Array], rng: np.random.Generator | None
) -> list[Experiment]:
    """The experiments with predicted positions (n_samples,) of each segment, and new noise in position and force; none
    without a generator.
    """
    rest, size, rng = iter(predicted), float(rng is not None), rng or np.random.default_rng(0)
    return [
        e.with_segments(tuple(noisy(e, s, next(rest), rng, size=size, force=size > 0) for s in e.segments))
        for e in experiments
    ]
