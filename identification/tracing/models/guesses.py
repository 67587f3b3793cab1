"""First guesses of effects beside a model: where their shapes and sizes are tried, and where their fits start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identification.data.grid import Grid
from identification.estimators.imposed_motion.grid import first_state
from identification.tracing.models.model import MEMORY_STEP, Model
from identification.tracing.models.trial_data import TrialData
from recordings import Array
from simulator import BASE, FirstLook, Parameter, kernel, shows_imposed

SMALL = 0.1
"""Share of its scale at which a strength is tried that can only grow."""
EffectGuesses = Sequence[Mapping[str, float]]
"""Guesses of one effect, likeliest first, as parameter values by full name."""


def looks(model: Model) -> list[FirstLook]:
    """The fitted recordings of a model at a first look, without what its effects beside the base explain already."""
    held = set(model.coordinates.names) - set(model.coordinates.free_names)
    return [
        FirstLook.of(grid.t, grid.motion, grid.force.u - _added(model, grid), model.values, held, pull)
        for grid, pull in zip(model.data.fitted, model.pulls, strict=True)
    ]


def _added(model: Model, grid: Grid) -> Array:
    """What effects beside the base add to the force along the smoothed motion (n,) [N], as far as they show there."""
    known, nothing = model.data.catalogue, np.zeros(len(grid.t))
    more = [effect for effect in model.effects if effect not in BASE and shows_imposed(known[effect])]
    if not more:
        return nothing
    driven = grid.driven_along(np.column_stack([grid.motion[:, :2], grid.force.u, nothing]))
    with_more, base = (_force(model, model.data.in_order(*BASE, *some), grid, driven) for some in (more, ()))
    return nothing if with_more is None or base is None else with_more - base


def _force(model: Model, effects: tuple[str, ...], grid: Grid, driven: Array) -> Array | None:
    """The force that a motion (n, 4) takes with some effects of a model (n,) [N]; None without a solution."""
    target = kernel(effects, "motion", model.data.catalogue)
    run = target.run(grid.t, driven, target.vector(model.values), first_state(target, driven), h_max=MEMORY_STEP)
    return None if run.failed is not None else run.outputs[:, 0]


def known_guesses(model: Model) -> Mapping[str, EffectGuesses]:
    """What every effect that a model does not have reads off its recordings, by id."""
    if not model.first_guesses:
        seen = looks(model)
        others = [effect for effect in model.data.candidates if effect not in model.effects]
        model.first_guesses.update({effect: guesses(model, seen, effect) for effect in others})
    return model.first_guesses


def guesses(model: Model, seen: Sequence[FirstLook], effect: str) -> EffectGuesses:
    """What an effect reads off recordings; empty where they do not show it."""
    off = {name: p.neutral for name, p in strengths(model.data, effect).items()}
    found = model.data.catalogue[effect].first_guess(seen, model.values)
    finite = [values for values in found if np.isfinite([*values.values()]).all()]
    return [values for values in finite if any(values.get(name, value) != value for name, value in off.items())]


def strengths(data: TrialData, effect: str) -> dict[str, Parameter]:
    """The parameters that vanish with an effect, by full name."""
    one = data.catalogue[effect]
    return {one.parameter_name(p.symbol): p for p in one.parameters if p.neutral is not None}


def shapes(data: TrialData, effect: str, found: EffectGuesses) -> list[dict[str, float]]:
    """The shapes at which an effect is tried, as parameter values by full name: as guessed, and as is typical. Where
    the sampling resolves the bristle, the guesses know better.
    """
    one = data.catalogue[effect]
    typical = {one.parameter_name(p.symbol): p.scale for p in one.parameters if p.neutral is None and not p.known}
    guessed = [*found, {}] if data.damped is not None or not found else found
    tried = [{name: guess.get(name, value) for name, value in typical.items()} for guess in guessed]
    return [shape for i, shape in enumerate(tried) if shape not in tried[:i]]


def sizes(data: TrialData, effect: str, found: EffectGuesses) -> list[dict[str, float]]:
    """The sizes beside zero at which strengths are tried that can only grow and work through memory: a play operator at
    rest on noise shows nothing to first order. In damped order nor does friction that is late by less than a sample, so
    there the scale itself is one of them.
    """
    if not data.catalogue[effect].memory:
        return []
    shares = (SMALL,) if data.damped is None else (SMALL, 1.0)
    tried = [
        {name: value}
        for name, p in strengths(data, effect).items() if p.lower == p.neutral
        for value in (*(guess[name] for guess in found if guess.get(name, p.lower) > p.lower),
                      *(share * p.scale for share in shares))
    ]  # fmt: skip
    return [size for i, size in enumerate(tried) if size not in tried[:i]]
