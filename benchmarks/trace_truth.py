"""Whether the recordings of a case show its effects: what the plant's own parameters gain over the base model.

An effect of a given strength leaves as much in a free run on the exact force. A noisy force forgives more, so some of
them cannot be told from chance on the recordings that a trace sees. Where the truth gains much and the trace found
little, its search failed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from benchmarks.plants.cases import Case
from benchmarks.plants.effects import Valve
from benchmarks.plants.recordings import recordings
from benchmarks.plants.truth import PARAMETERS, true_values
from identification.data.experiment import experiment
from identification.estimators.estimate import lean
from identification.given import plant_constants
from identification.tracing import settings
from identification.tracing.models.base import base_model
from identification.tracing.models.model import Model
from recordings import NegativeAnswer
from simulator import CATALOGUE


def has_truth(case: Case) -> bool:
    """Whether a case has effects whose law the catalogue has, so that its truth can be fitted."""
    return case.form == "same" and not case.rig and bool(case.effects) and {*case.effects} <= {*PARAMETERS}


def gain_of_truth(case: Case, given: Mapping[str, float] | None = None) -> float:
    """By how much the cost of the base model falls with the effects of a case, fitted on from the truth; NaN where one
    of them cannot be fitted. given : base parameters that the trace knows.
    """
    fitted, held_out, strengths = recordings(case)
    experiments, others = ([experiment(r) for r in some] for some in (fitted, held_out))
    try:
        base = base_model(experiments, others, plant_constants(experiments) | dict(given or {}), CATALOGUE)
    except NegativeAnswer:
        return float("nan")
    ends = from_truth(base, case.effects, true_values(strengths, Valve.of(case.valve)))
    return base.cost - min((model.cost for model in ends), default=float("nan"))


def from_truth(base: Model, effects: tuple[str, ...], values: dict[str, float]) -> Iterator[Model]:
    """Models with some effects more, fitted on from values by name: on new paths, and along those of the base model."""
    data, names = base.data, base.data.in_order(*base.effects, *effects)
    work = data.estimator(names, worth=settings.CHANCE_GAIN)
    end = work.fit(work.coordinates.theta_of(values), settings.STEPS)
    if end is not None:
        yield Model(names, data, lean(end)).refitted()
    grown: Model | None = base
    for effect in effects:
        grown = None if grown is None else grown.with_effect(effect, values)
    if grown is not None:
        yield grown.refitted()
