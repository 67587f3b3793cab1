"""Fit a valve to recordings without start values: starts, homotopy, polish, and an outcome in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Literal

import numpy as np

from identification.data.experiment import Experiment
from identification.estimators.coordinates import Coordinates, parameters
from identification.estimators.imposed_motion.start import fit_imposed
from identification.estimators.noise_aware.estimator import Estimate
from identification.estimators.noise_aware.force_noise import (
    RESOLVED,
    fit_uncertain,
    force_noise_matters,
    loose_start,
    turn,
)
from identification.estimators.noise_aware.search import HOPELESS, converged
from identification.estimators.output_error.basin_search import shaken
from identification.estimators.output_error.homotopy import Homotopy, Path
from identification.estimators.output_error.problem import Problem
from identification.estimators.starting_values import Start, regression, starts
from recordings import Array, BadInput
from simulator import BASE, CATALOGUE, Kernel, kernel

Estimator = Literal["auto", "output-error", "noise-aware"]
"""How a force-driven fit is made: `output-error` takes the recorded force for exact, `noise-aware` estimates it along
with the motion, `auto` takes the second where the force has noise that matters."""

TRIES = 4
"""Starts that are followed at most."""
FEWEST = 3
"""Samples per free parameter below which no fit is tried."""
WORTH = 0.98
"""A further start is tried only while the last one brought the cost below this share of the best before it."""
GOOD_ENOUGH = 1.15
"""Normalised root mean square residual at which no further start is tried."""
LOST = 2.0
"""The same of a fit that follows the data, from which one more start is made, with the force taken for uncertain."""

REAL_TRAVEL = 10.0
"""Way, in standard deviations of the noise, from which a position counts as moved."""

INTEGRATING_WINDOW = 0.01
"""Reset window [s] of the last stage for a plant without spring: it integrates every error of the model without limit,
so that its free run says more about the model's smallest flaw than about its parameters."""


class Outcome(Enum):
    """How a fit ended, with a sentence each."""

    CONVERGED = "the fit converged"
    NOT_SETTLED = "the fit ran out of iterations before it settled; take the values as approximate"
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
        return self.name in ("CONVERGED", "NOT_SETTLED", "NOT_CONVERGED", "NOT_EXPLAINED")


@dataclass(frozen=True)
class Fit:
    """A fit as a value. kernel, coordinates, problem, path: what was solved and where it ended (None when nothing could
    be); rms : normalised root mean square residual (of the innovations where the force is estimated), 1 at the noise
    floor; estimate : what was estimated of the force and the motion, where the fit is noise-aware.
    """

    outcome: Outcome
    kernel: Kernel
    coordinates: Coordinates
    problem: Problem | None = None
    path: Path | None = None
    rms: float = float("nan")
    estimate: Estimate | None = None

    @property
    def estimator(self) -> str:
        """Which estimator made the fit."""
        return "output-error" if self.estimate is None else "noise-aware"

    @property
    def p(self) -> Array:
        """The parameter vector, in kernel order."""
        assert self.path is not None
        return self.coordinates.p(self.path.unknowns[: int(self.coordinates.free.sum())])

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by full name, SI units."""
        return dict(zip(self.kernel.parameters, self.p.tolist(), strict=True))


def fit(
    experiments: Sequence[Experiment],
    *,
    effects: tuple[str, ...] = BASE,
    given: Mapping[str, float] | None = None,
    estimator: Estimator = "auto",
) -> Fit:
    """Fit all free parameters of `effects` to all experiments at once.

    given : parameters by full name that are held, SI units; estimator : see `Estimator`. Raises BadInput for a name
    no effect has, for a value out of its bounds, and for experiments of different causality.
    """
    given = _known(effects, experiments) | dict(given or {})
    causalities = {e.causality for e in experiments}
    if len(causalities) != 1:
        raise BadInput("recordings", "some are force-driven and some motion-driven", "fit them separately")
    valve = kernel(effects, causalities.pop())
    check_given(given, valve)
    force = np.concatenate([s.u for e in experiments for s in e.segments])
    coordinates = Coordinates.of(valve, given, float(np.std(force)) or 1.0)
    hindered = obstacle(experiments, coordinates, force)
    if hindered is not None:
        return Fit(hindered, valve, coordinates)
    if valve.causality == "motion":
        path, problem = fit_imposed(valve, coordinates, experiments)
        return judged(valve, coordinates, problem, path)
    if _noise_aware(estimator, coordinates, experiments):
        return _uncertain(valve, coordinates, experiments)
    return _force_driven(valve, coordinates, experiments)


def _known(effects: tuple[str, ...], experiments: Sequence[Experiment]) -> dict[str, float]:
    """Parameters that are to be held at what is known of the valve: a sensor's range is the stroke."""
    stroke = next((float(e.plant["stroke_m"]) for e in experiments if "stroke_m" in e.plant), None)
    chosen = [(effect, p) for effect in CATALOGUE.pick(effects) for p in effect.parameters if p.known]
    return {e.parameter_name(p.symbol): stroke if stroke and p.unit == "m" else p.scale for e, p in chosen}


def _noise_aware(estimator: Estimator, coordinates: Coordinates, experiments: Sequence[Experiment]) -> bool:
    """Whether to estimate the force. A plant without spring integrates every error of its model, which no noise of the
    force explains: there the motion is reset to the data instead, as output error does. A held force is a converter's
    output and exact.
    """
    if estimator != "auto":
        return estimator == "noise-aware"
    held = any(e.hold for e in experiments)
    return not held and not _integrates(coordinates) and force_noise_matters(experiments)


def _integrates(coordinates: Coordinates) -> bool:
    held = dict(zip(coordinates.names, coordinates.base, strict=True)).get("spring.K") == 0.0
    return held and not _free(coordinates, "spring.K")


def _uncertain(valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment]) -> Fit:
    found = fit_uncertain(valve, coordinates, experiments)
    if found is None:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    return fit_of(found.estimate, found.problem, found.path)


def fit_of(estimate: Estimate, problem: Problem, path: Path) -> Fit:
    """A noise-aware estimate as a fit, with its outcome; problem, path : the same end as a free run."""
    resolved = turn(problem.coordinates.values(estimate.theta), problem) < RESOLVED
    outcome = Outcome.CONVERGED if converged(estimate, resolved=resolved) else Outcome.NOT_CONVERGED
    if estimate.loss > HOPELESS:
        outcome = Outcome.NOT_EXPLAINED
    rms = float(np.sqrt(estimate.loss))
    return Fit(outcome, problem.kernel, problem.coordinates, problem, path, rms, estimate)


def check_given(given: Mapping[str, float], valve: Kernel) -> None:
    """Raise BadInput for a held parameter that the valve has not, or that no valve can have."""
    known = parameters(valve)
    for name, value in given.items():
        if name not in known:
            raise BadInput(f"--given {name}", "no such parameter", f"there are {', '.join(known)}")
        if not known[name].lower <= value <= known[name].upper:
            allowed = f"it is from {known[name].lower:g} to {known[name].upper:g} {known[name].unit}"
            raise BadInput(f"--given {name}", f"no valve has {value:g}", allowed)


def _force_driven(valve: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment]) -> Fit:
    window = INTEGRATING_WINDOW if _integrates(coordinates) else np.inf
    homotopy, best = Homotopy(valve, coordinates, experiments, window), None
    ranked = starts(homotopy.early.experiments, valve.effects, coordinates)
    for attempt in range(TRIES):
        theta = _next_start(attempt, ranked, best, homotopy)
        path = None if theta is None else homotopy.follow(theta)
        stuck = path is None or (best is not None and path.level > WORTH * best.level)
        if path is not None and (best is None or path.level < best.level):
            best = path
        reached = best is not None and np.sqrt(best.level) < GOOD_ENOUGH
        if reached or (attempt > 1 and stuck):
            break
    found = judged(valve, coordinates, homotopy.full, _polished(homotopy, best))
    if found.outcome not in (Outcome.CONVERGED, Outcome.NOT_SETTLED) or found.rms < LOST or _integrates(coordinates):
        return found
    theta = loose_start(valve, coordinates, experiments)
    end = _polished(homotopy, None if theta is None else homotopy.follow(theta))
    other = judged(valve, coordinates, homotopy.full, end)
    return other if other.rms < found.rms else found


def _polished(homotopy: Homotopy, path: Path | None) -> Path | None:
    """A path on whole recordings by plain least squares."""
    whole = None if path is None else homotopy.carried(path)
    return None if whole is None else homotopy.polish(whole)


def _free(coordinates: Coordinates, name: str) -> bool:
    return name in coordinates.names and bool(coordinates.free[coordinates.names.index(name)])


def _next_start(attempt: int, ranked: Sequence[Start], best: Path | None, homotopy: Homotopy) -> Array | None:
    """The best start first; then the best path shaken out of a wrong basin; then other starts, shaken likewise."""
    if attempt == 1 and best is not None:
        return shaken(best.unknowns[: homotopy.full.n_free], homotopy)
    place = max(attempt - 1, 0)
    if place >= len(ranked):
        return None
    return ranked[0].theta if attempt == 0 else shaken(ranked[place].theta, homotopy)


def obstacle(experiments: Sequence[Experiment], coordinates: Coordinates, force: Array) -> Outcome | None:
    """What makes a fit impossible before it starts, if anything."""
    if np.ptp(force) == 0.0:
        return Outcome.CONSTANT_INPUT
    if sum(e.samples for e in experiments) < FEWEST * coordinates.free.sum():
        return Outcome.TOO_SHORT
    up, down = _travel(experiments)
    still = all(np.ptp(s.y) == 0.0 for e in experiments for s in e.segments)
    if still or max(up, down) < REAL_TRAVEL or regression(experiments) is None:
        return Outcome.NO_MOTION
    return Outcome.NO_FRICTION if min(up, down) < REAL_TRAVEL and _free(coordinates, "spring.F0") else None


def _travel(experiments: Sequence[Experiment]) -> tuple[float, float]:
    """The longest way up and the longest way down in one segment, in standard deviations of the position's noise."""
    steps = [s.motion.crept[:-1] * np.diff(s.t) / e.noise_position for e in experiments for s in e.segments]
    return max(float(d[d > 0].sum()) for d in steps), max(float(-d[d < 0].sum()) for d in steps)


def judged(valve: Kernel, coordinates: Coordinates, problem: Problem, path: Path | None) -> Fit:
    """A fit with its outcome: whether anything was found, whether it settled, and whether it explains the data."""
    if path is None:
        return Fit(Outcome.DIVERGED, valve, coordinates)
    square, level = 0.0, 0.0
    for i, response in enumerate(problem.responses(path.unknowns, path.setting)):
        if response is None:
            return Fit(Outcome.DIVERGED, valve, coordinates)
        segment, noise = problem.pieces[i].segment, problem.pieces[i].noise
        measured = segment.y if valve.causality == "force" else segment.u
        square += float(np.sum(problem.residual(i, response) ** 2))
        level += float(np.sum(((measured - measured.mean()) / noise)[segment.seen] ** 2))
    outcome = Outcome.CONVERGED if path.settled else Outcome.NOT_SETTLED
    if square > 0.5 * level:
        outcome = Outcome.NOT_EXPLAINED
    return Fit(outcome, valve, coordinates, problem, path, float(np.sqrt(square / problem.samples)))
