"""Parametric bootstrap: how a fit scatters over recordings that its own model could have given.

The fitted model is run on the (smoothed) recorded input, noise of the estimated size is added to all channels, and the
replicates are fitted like the recordings (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, ch. 6).
What the linearised covariance cannot know is in it: bias, bends of the likelihood, descents that end elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.data.experiment import Experiment, Segment, noisy
from identification.data.grid import grids
from identification.estimators.fit import fit
from identification.estimators.fitted import Fit, held
from identification.estimators.noise_aware.best_paths import LAST, noise_aware_for
from identification.estimators.output_error.replicates import replicates
from identification.uncertainty.covariance import Uncertainty, status_and_note, widened_rms
from recordings import Array, BadParameter, NegativeAnswer, Progress, silent

REFITTED = 15
"""Steps of the fit on a replicate of damped order."""
FEWEST, MOST_FAILED = 5, 0.5
"""Trials that are asked for at least, and share of them that may fail."""


@dataclass(frozen=True)
class Bootstrap:
    """How the fits of replicates scatter. trials : number of replicates; failed : how many of them led nowhere; names :
    of the free parameters; values : (n_good, n_free) by `names`, SI units.
    """

    trials: int
    failed: int
    names: tuple[str, ...]
    values: Array


def checked_trials(trials: int) -> int:
    """The number of trials; 0 is none. Raises BadParameter for too few to say anything."""
    if trials != 0 and trials < FEWEST:
        raise BadParameter("bootstrap", trials, "that is too few to scatter", f"ask for {FEWEST} or more, or for 0")
    return trials


def bootstrap_of(found: Fit, trials: int, seed: int = 0, progress: Progress = silent) -> Bootstrap:
    """Fit `trials` replicates of a fit's recordings, drawn with a seed.

    Raises NegativeAnswer when more than half of them lead nowhere.
    """
    free = found.coordinates.free
    if found.order != "full" and found.noise_aware is None:
        return _of_windows(found, trials, seed)
    rng = np.random.default_rng(seed)
    values = []
    for done in range(trials):
        p = _refitted(found, replicate(found, rng, size=max(found.rms, 1.0)), rng)
        progress("bootstrap", done + 1, trials)
        if p is not None:
            values.append(p[free])
    return _scatter(found, trials, values)


def _of_windows(found: Fit, trials: int, seed: int) -> Bootstrap:
    """The bootstrap of a fit of damped order, whose replicates are of full order."""
    assert found.problem is not None
    assert found.minimum is not None
    unknowns, c = found.minimum.unknowns, found.coordinates
    drawn = replicates(found.problem, unknowns, found.minimum.setting, trials, steps=REFITTED, seed=seed)
    moves = [] if drawn is None else list(drawn.moves)
    return _scatter(found, trials, [c.p(unknowns[: c.n_free] + move)[c.free] for move in moves])


def _scatter(found: Fit, trials: int, values: list[Array]) -> Bootstrap:
    if len(values) < max(2, (1 - MOST_FAILED) * trials):
        raise NegativeAnswer(f"only {len(values)} of {trials} fits of the bootstrap led anywhere; record longer")
    return Bootstrap(trials, trials - len(values), found.coordinates.free_names, np.array(values))


def with_bootstrap(found: Fit, known: Uncertainty, scatter: Bootstrap) -> Uncertainty:
    """The uncertainty with standard deviations from the bootstrap: root mean squares about the estimate, bias included,
    widened by Student's t for the number of trials. What the estimate may be off beside the noise stays in them
    (`Fit.systematic`): replicates that start from it show nothing of that but the bias of the order.
    """
    spread = widened_rms(scatter.values - np.array([found.values[n] for n in scatter.names]))
    if found.systematic is not None:
        spread = np.hypot(spread, found.systematic * found.coordinates.slope(found.p))
    std = dict(zip(scatter.names, spread.tolist(), strict=True))
    status, note = status_and_note(found, known.names, std, known.correlation, proven=True)
    return replace(known, spread=std, status=status, note=note)


def replicate(found: Fit, rng: np.random.Generator, size: float = 1.0) -> list[Experiment]:
    """The experiments as the fitted model would have given them. size : factor on the noise of the output."""
    assert found.problem is not None
    assert found.minimum is not None
    setting = replace(found.minimum.setting, tuning=np.inf)
    answers = iter(found.problem.responses(found.minimum.unknowns, setting))
    replicates = []
    for e in found.problem.experiments:
        segments = []
        for s in e.segments:
            response = next(answers)
            predicted = s.y if response is None else response.predicted
            segments.append(_redrawn(found, e, s, predicted, size, rng))
        replicates.append(e.with_segments(tuple(segments)))
    return replicates


def _redrawn(
    found: Fit, e: Experiment, s: Segment, predicted: Array, size: float, rng: np.random.Generator
) -> Segment:  # fmt: skip
    """A segment with a predicted output and noise on what carries noise in this fit."""
    if e.causality == "motion":
        return replace(s, u=predicted + rng.normal(0.0, size * e.noise_force, len(predicted)))
    return noisy(e, s, predicted, rng, size=size, force=found.estimate is not None)


def _refitted(found: Fit, experiments: list[Experiment], rng: np.random.Generator) -> Array | None:
    """The parameter vector of a replicate: a noise-aware fit goes on from the estimate, another starts from nothing."""
    c = found.coordinates.with_drawn_priors(found.coordinates.theta(found.p), rng)
    if found.estimate is None:
        again = fit(
            experiments, effects=found.kernel.effects, given=held(found), estimator="output-error",
            catalogue=found.kernel.catalogue, priors={name: (mean, std) for name, mean, std in c.priors},
            constraints=[str(one) for one in c.constraints],
        )  # fmt: skip
        return again.p if again.outcome.usable else None
    theta, known = found.estimate.theta, grids(experiments)
    work = noise_aware_for(found.kernel, c, known, [theta], found.order)
    start = work.start(theta)
    return None if start is None else c.p(work.descend(start, LAST).theta)
