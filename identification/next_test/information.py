"""What a test would teach: intervals of parameters, and how far rivals would be apart.

Both rest on the sensitivities of the compiled physics, at the values that are known now and with what is known of them
as a prior. D-optimal for parameters, T-optimal between rivals: Atkinson, Donev and Tobias, Optimum Experimental
Designs, with SAS (2007), chapters 10 and 20.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.data.experiment import experiment
from identification.estimators.output_error.damped import search_for
from identification.estimators.output_error.descent import FreeRunDescent, Minimum
from identification.next_test.knowledge import DrivenTest, ExpectedPath, KnownValve
from identification.uncertainty.covariance import WEAK
from recordings import Array, Recording

SEED = 26
"""Of the noise on an answer to which a rival is fitted."""
ENOUGH = WEAK / 3
"""Relative standard deviation of a parameter that is known well: there a fit's wider intervals are not weak, either."""
USELESS = 3.0
"""Relative error of a parameter that is as bad as any larger one."""
CLIPPED = 5.0
"""What a single sample says at most, in noise sigmas."""


def answered(valve: KnownValve, test: DrivenTest) -> ExpectedPath | None:
    """What a model expects of a test that begins at rest; None where it diverges."""
    return valve.response(test, valve.p, valve.at_rest(float(test.force[0])))


def expected_std(valve: KnownValve, path: ExpectedPath) -> Array:
    """Standard deviations (n_free,) of the parameters after a test, SI units."""
    spread = np.sqrt(np.diag(_covariance(valve, path)))[: len(valve.names)]
    return np.asarray(spread * np.abs(valve.coordinates.slope(valve.p)), float)


def gained(valve: KnownValve, path: ExpectedPath, names: tuple[str, ...]) -> float:
    """Minus the logarithm of the determinant of the covariance of some parameters after a test: D-optimal for them.

    What is enough to know of each is added to the covariance: a parameter that is known well teaches nothing by being
    known better, and one that is still weak is not outweighed by it.
    """
    chosen = [valve.names.index(name) for name in names]
    covariance = _covariance(valve, path)[np.ix_(chosen, chosen)]
    slope = np.abs(valve.coordinates.slope(valve.p))[chosen]
    values = np.abs([valve.values[name] for name in names])
    return -float(np.linalg.slogdet(covariance + np.diag((ENOUGH * values / np.maximum(slope, 1e-300)) ** 2))[1])


def apart(y: Array, rival: KnownValve, path: ExpectedPath) -> float:
    """Distance of two answers [noise sigmas] that is left when the rival's parameters follow, to first order.

    y (n_samples,) : what a model answers [m]; path : the answer of its rival. A sample counts at most `CLIPPED`: a test
    that differs all along is better than one with a single slip that comes early.
    """
    r: Array = np.clip((y - path.y) / rival.noise, -CLIPPED, CLIPPED)
    towards = (path.by / rival.noise).T @ r
    explained = towards @ _covariance(rival, path) @ towards
    return float(np.sqrt(max(float(r @ r) - float(explained), 0.0)))


def fitted_apart(y: Array, rival: KnownValve, test: DrivenTest) -> float:
    """Distance of a rival from the answer y (n_samples,) [m] of a model, in noise sigmas, when the rival is really
    fitted to it. 0 where the rival diverges: nothing is promised then.
    """
    stages, best, noise = _fitted(y, rival, test)
    if best is None:
        return 0.0
    answers = stages.full.responses(best.unknowns, best.setting)
    left = sum(float(np.sum(stages.full.residual(i, y) ** 2)) if y else 0.0 for i, y in enumerate(answers))
    return float(np.sqrt(max(left - float(np.sum((noise / rival.noise) ** 2)), 0.0)))


def rehearsed(true: KnownValve, guess: KnownValve, test: DrivenTest, names: tuple[str, ...]) -> float:
    """How well a test on a true valve tells some parameters when it is really fitted, from a guess of them: minus the
    mean logarithm of their relative errors, of which a third of what is weak is as good as none.
    """
    y = true.path(test, true.p, true.at_rest(float(test.force[0])))
    best = None if y is None else _fitted(y, guess, test)[1]
    if best is None:
        return -float(np.log(USELESS))
    values = dict(zip(guess.kernel.parameters, guess.coordinates.p(best.unknowns[: len(guess.names)]), strict=True))
    errors = [abs(values[name] - true.values[name]) / max(abs(true.values[name]), 1e-300) for name in names]
    return -float(np.mean(np.log(np.clip(errors, ENOUGH, USELESS))))


def _fitted(y: Array, valve: KnownValve, test: DrivenTest) -> tuple[FreeRunDescent, Minimum | None, Array]:
    """A valve fitted to what a test shows (n_samples,) [m], with seeded noise, which is returned too, by the stages of
    an ordinary fit; nothing is known beforehand but where to begin, and what runs in windows make of it. None where it
    diverges.
    """
    noise = np.random.default_rng(SEED).normal(0.0, valve.noise, len(y))
    recording = Recording.from_arrays(time=test.t, force=test.force, position=y + noise)
    made = replace(experiment(recording, "force", hold=test.hold), noise_position=valve.noise)
    stages = FreeRunDescent(valve.kernel, valve.coordinates, [made])
    search = search_for(valve.kernel, valve.coordinates, [made], "damped")
    narrowed = None if search is None else search.narrowed(valve.theta)
    ends = [stages.follow(theta) for theta in (valve.theta, narrowed) if theta is not None]
    end = stages.refined(min((end for end in ends if end is not None), key=lambda end: end.level, default=None))
    return stages, None if end is None else stages.polish(end), noise


def _covariance(valve: KnownValve, path: ExpectedPath) -> Array:
    """Covariance (n_free + n_starts)^2 of the coordinates and the start after a test."""
    spread = np.concatenate([valve.std, valve.start_std])
    scaled = path.by / valve.noise * spread
    inner = np.linalg.inv(scaled.T @ scaled + np.eye(len(spread)))
    return np.asarray(inner * np.outer(spread, spread), float)
