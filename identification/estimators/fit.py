"""Fit a valve to recordings without starting values, with the estimator that suits them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from identification.budget import time_is_over
from identification.data.experiment import Experiment
from identification.data.grid import grids, with_smooth_force
from identification.data.largest_mass import largest_mass
from identification.estimators.by_order import fit_damped, fit_full, starting_points
from identification.estimators.constraints import checked
from identification.estimators.coordinates import Coordinates
from identification.estimators.feasibility import check_constraints, check_effects, check_given, check_priors, obstacle
from identification.estimators.fitted import Fit, Outcome
from identification.estimators.imposed_motion.fit import fit_imposed_motion
from identification.estimators.noise_aware.fit import force_noise_matters
from identification.estimators.noise_aware.resolution import resolved_by_nodes
from identification.estimators.order import Order, order_of, swing
from identification.estimators.output_error.descent import chunked
from identification.estimators.output_error.fit import fit_output_error, integrates
from identification.estimators.output_error.starting_values import StartingPoint, starting_values
from recordings import BadInput, Progress, silent
from simulator import BASE, CATALOGUE, Catalogue, Effect, Kernel, kernel

Estimator = Literal["auto", "output-error", "noise-aware"]
"""How a force-driven fit is made: `output-error` takes the recorded force for exact, `noise-aware` estimates it along
with the motion, `auto` takes the second where the force has noise that matters."""


def fit(
    experiments: Sequence[Experiment],
    *,
    effects: tuple[str, ...] = BASE,
    given: Mapping[str, float] | None = None,
    estimator: Estimator = "auto",
    catalogue: Catalogue = CATALOGUE,
    order: Order | Literal["auto"] = "auto",
    priors: Mapping[str, tuple[float, float]] | None = None,
    constraints: Sequence[str] = (),
    progress: Progress = silent,
) -> Fit:
    """Fit all free parameters of some effects to all experiments at once.

    Parameters
    ----------
    experiments : sequence of Experiment
        Recordings made ready by `experiment`, all of one causality.
    effects : tuple of str
        Identifiers of the effects that make the model, those of `BASE` among them.
    given : mapping, optional
        Parameters by full name that are held, SI units: ``{"mass.m": 2.1}``.
    estimator : {"auto", "output-error", "noise-aware"}
        See `Estimator`. It has no part where the motion is imposed.
    catalogue : Catalogue
        Where the effects are looked up: ``CATALOGUE.extended(MyEffect())`` for one of your own.
    order : {"auto", "full", "damped", "static"}
        What of the model the sampling resolves (`order.py`); by default the recordings say. It has no part where the
        motion is imposed or the plant has no spring, and an `estimator` that is asked for by name is one of full order.
    priors : mapping, optional
        What is known of parameters beforehand: mean and standard deviation by full name, SI units.
    constraints : sequence of str
        What the fit must keep to: ``["lugre.fs>=1.05*lugre.fc", "mass.m<=5"]``, SI units.
    progress : callable, optional
        Told the stages of the fit.

    Returns
    -------
    Fit
        Also where nothing came out: ask ``outcome.usable``. It is `Outcome.OUT_OF_TIME` where a budget that is in force
        was spent before the end.

    Raises
    ------
    BadParameter
        For an effect that is not in the catalogue, effects without those of `BASE`, a held parameter that no effect
        has, or a value out of its bounds.
    BadInput
        For experiments of different causality.
    """
    check_effects(effects, catalogue)
    given = _known(catalogue.pick(effects), experiments) | dict(given or {})
    causalities = {e.causality for e in experiments}
    if len(causalities) != 1:
        raise BadInput("recordings", "some are force-driven and some motion-driven", "fit them separately")
    valve = kernel(effects, causalities.pop(), catalogue)
    check_given(given, valve)
    check_priors(priors or {}, valve)
    force = np.concatenate([s.u for e in experiments for s in e.segments])
    coordinates = Coordinates.of(valve, given, float(np.std(force)) or 1.0, priors)
    if valve.causality == "force":
        coordinates = coordinates.below({"mass.m": largest_mass(experiments)})
    coordinates = replace(coordinates, constraints=checked(constraints, coordinates.names, coordinates.logs))
    check_constraints(constraints, coordinates)
    hindered = obstacle(experiments, coordinates, force)
    if hindered is not None:
        return Fit(hindered, valve, coordinates)
    if valve.causality == "motion":
        found = fit_imposed_motion(valve, coordinates, experiments, progress)
    else:
        found = _force_driven(valve, coordinates, experiments, estimator, order, progress)
    return replace(found, outcome=Outcome.OUT_OF_TIME) if time_is_over() and found.outcome.usable else found


def _force_driven(
    valve: Kernel,
    coordinates: Coordinates,
    experiments: Sequence[Experiment],
    estimator: Estimator,
    order: Order | Literal["auto"],
    progress: Progress,
) -> Fit:
    """The fit of a valve that the recorded force drives, by the order and the estimator that suit it."""
    noisy = _noise_aware(estimator, coordinates, experiments)
    segment_grids = grids(experiments) if noisy else []
    driven = with_smooth_force(experiments, segment_grids) if noisy else experiments
    if estimator != "auto" or integrates(coordinates):
        order = "full"
    told = order != "auto"
    progress("starting values", 0, 0)
    starts_tell = not told or order == "full"
    ranked = starting_values(chunked(driven) or driven, valve, coordinates) if starts_tell else []
    spacing = max(s.dt for e in experiments for s in e.segments)
    chosen: Order = _order(coordinates, ranked, spacing, noisy) if order == "auto" else order
    if chosen != "full":
        smooth = driven if noisy else with_smooth_force(experiments)
        found = fit_damped(valve, coordinates, smooth, chosen, segment_grids, progress, told=told)
        if told or found.outcome is not Outcome.TOO_SHORT:  # for the loop of force over position
            return found
    if noisy:
        starts = starting_points(valve, coordinates, driven, ranked, progress)
        found = fit_full(valve, coordinates, driven, segment_grids, starts, progress)
        if told or _resolves(found, spacing) or time_is_over():
            return found
        damped = fit_damped(valve, coordinates, driven, "damped", segment_grids, progress)
        return damped if damped.outcome is Outcome.CONVERGED else found
    exact = estimator != "auto" or any(e.hold for e in experiments)  # a converter's output has no error
    return fit_output_error(valve, coordinates, experiments, ranked, progress, exact=exact)


def _resolves(found: Fit, spacing: float) -> bool:
    """Whether nodes between samples `spacing` [s] apart resolve the swing that a fit in full order ended with: starting
    values may be too soft.
    """
    return not found.outcome.usable or resolved_by_nodes(found.values, spacing)


def _order(coordinates: Coordinates, ranked: Sequence[StartingPoint], spacing: float, noisy: bool) -> Order:
    """The order by the stiffest bristle and lightest mass that starting values from the recordings have."""
    if not ranked:
        return "full"
    quickest = max((coordinates.values(start.theta) for start in ranked), key=swing)
    return order_of(quickest, spacing, noisy=noisy)


def _known(effects: Sequence[Effect], experiments: Sequence[Experiment]) -> dict[str, float]:
    """Parameters that are to be held at what is known of the valve: a sensor's range is the stroke."""
    stroke = next((float(e.plant["stroke_m"]) for e in experiments if "stroke_m" in e.plant), None)
    chosen = [(effect, p) for effect in effects for p in effect.parameters if p.known]
    return {e.parameter_name(p.symbol): stroke if stroke and p.known == "stroke" else p.scale for e, p in chosen}


def _noise_aware(estimator: Estimator, coordinates: Coordinates, experiments: Sequence[Experiment]) -> bool:
    """Whether to estimate the force. A plant without spring integrates every error of its model, which no noise of the
    force explains: there the motion is reset to the data instead, as output error does. A held force is a converter's
    output and exact.
    """
    if estimator != "auto":
        return estimator == "noise-aware"
    held = any(e.hold for e in experiments)
    return not held and not integrates(coordinates) and force_noise_matters(experiments)
