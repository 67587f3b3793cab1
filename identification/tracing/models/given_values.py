"""What effects gain from values that are known: by the truth of a simulated valve, whether recordings show them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from identification.data.experiment import experiment
from identification.estimators.estimate import lean
from identification.given import plant_constants
from identification.tracing import settings
from identification.tracing.models.base import base_model
from identification.tracing.models.model import Model
from recordings import NegativeAnswer, Recording
from simulator import CATALOGUE, Catalogue


def gain_of_values(
    recordings: Sequence[Recording],
    effects: Sequence[str],
    values: Mapping[str, float],
    *,
    holdout: Sequence[Recording] = (),
    given: Mapping[str, float] | None = None,
    catalogue: Catalogue = CATALOGUE,
) -> float:
    """By how much the cost of the base model of a trace falls with some effects, fitted on from values that are known,
    all of the base and of the effects by full name. NaN where one of the two cannot be fitted. given : as of `trace`.
    """
    fitted, held_out = ([experiment(r) for r in some] for some in (recordings, holdout))
    try:
        base = base_model(fitted, held_out, plant_constants(fitted) | dict(given or {}), catalogue)
    except NegativeAnswer:
        return float("nan")
    return base.cost - min((model.cost for model in _fitted_on(base, effects, values)), default=float("nan"))


def _fitted_on(base: Model, effects: Sequence[str], values: Mapping[str, float]) -> Iterator[Model]:
    """Models with some effects more, fitted on from values: on new paths, and along those of the base model."""
    names = base.data.in_order(*base.effects, *effects)
    work = base.data.estimator(names, worth=settings.CHANCE_GAIN)
    end = work.fit(work.coordinates.theta_of(values), settings.STEPS)
    if end is not None:
        yield Model(names, base.data, lean(end)).refitted()
    grown: Model | None = base
    for effect in effects:
        grown = None if grown is None else grown.with_effect(effect, values)
    if grown is not None:
        yield grown.refitted()
