"""Tracing: which effect a model of mass, spring and LuGre friction lacks, by forward selection.

    base model      fit the base effects to the recordings                                        models/base.py
    repeat, up to three times, while an effect is accepted:
        guess       read starting values of every effect off the recordings                       models/guesses.py
        screen      score every effect of the catalogue at its guess (Rao's score test)           screen.py
        paths       refit those with the best scores on the model's own paths                     shortlist.py
        shortlist   fit those that promise enough to chunks, the most promising first             shortlist.py
        refit       refit those that gain most to the whole recordings                            refine.py
        judge       compare each refit with the model on held-out recordings                      judge.py
        accept      take the simplest of those that explain these as well as the best             classes.py
        order       begin again in full order, where the best refit asks for it                   candidates.py
        prune       drop effects that the others make needless; the most needed comes first       several.py
        null test   ask whether as much is gained where nothing is missing                        null_bootstrap.py
    swap            try others in the place of each of several effects                            several.py
    verdict         name the effect, if hardly anything is missing with it                        verdict.py
    report          give the errors before and after on what neither fitted nor chose             tracing_procedure.py

Nothing is accepted for fitting better: an effect has to explain recordings that were not fitted. Without a name the
verdict is `none` (the residual is noise) or `unlisted` (it is not, and no candidate explains it). When the budget of
time is over, the best answer so far is given, with what was not tried (`identification/budget.py`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from identification.budget import Budget
from identification.data.experiment import Experiment, experiment
from identification.data.uses import check_used_once
from identification.estimators.coordinates import Coordinates
from identification.estimators.feasibility import check_given, obstacle
from identification.given import plant_constants
from identification.tracing import settings
from identification.tracing.candidates import candidates_of_round, in_wrong_order
from identification.tracing.classes import in_the_end, one_accepted, several_accepted
from identification.tracing.judge import Candidate, judged_by_chance
from identification.tracing.models.base import base_model, polished, with_stiffness_growth
from identification.tracing.models.model import Model
from identification.tracing.models.trial_data import divided
from identification.tracing.null_bootstrap import null_probability
from identification.tracing.several import pruned, swapped
from identification.tracing.verdict import BASE_MODEL, Selection, concluded
from recordings import BadInput, NegativeAnswer, Progress, Recording, silent
from simulator import BASE, CATALOGUE, Catalogue, kernel

Rounds = list[tuple[Candidate, ...]]
"""The candidates of every round, best first."""


class Parts(NamedTuple):
    """What is fitted, what chooses, and what neither does: the errors before and after are reported on it."""

    fitted: list[Experiment]
    held_out: list[Experiment]
    report: list[Experiment]


def select(
    recordings: Sequence[Recording],
    *,
    holdout: Sequence[Recording] = (),
    report_on: Sequence[Recording] = (),
    budget: Budget | None = None,
    given: Mapping[str, float] | None = None,
    hold: bool = False,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Selection:
    """Trace what a base model lacks. Raises BadInput for recordings that cannot be used, NegativeAnswer when the base
    model cannot be fitted at all.
    """
    check_used_once(recordings, holdout, report_on)
    parts, budget = _parts(recordings, holdout, report_on, hold), budget or Budget()
    known = plant_constants(parts.fitted) | dict(given or {})
    _check(parts.fitted, known, catalogue)
    progress("base model", 0, 1)
    base = base_model(parts.fitted, parts.held_out, known, catalogue, _of("base model", progress))
    budget.allows(BASE_MODEL)  # what its fit had no time for, it left out
    progress("base model", 1, 1)
    base, model, added, rounds = forward_selection(base, budget, progress)
    model, added, candidates, same_class = _reconsidered(model, added, rounds, budget)
    found = concluded(base, model, added, candidates, same_class)
    return replace(found, report_experiments=tuple(parts.report), not_tried=tuple(dict.fromkeys(budget.not_tried)))


def forward_selection(
    base: Model, budget: Budget, progress: Progress = silent
) -> tuple[Model, Model, tuple[str, ...], Rounds]:
    """Effects added one by one: the base, the model, the effects, most needed first, and all rounds.

    An effect may only have shown the way to a better end of the base model; then everything begins again from there.
    """
    model, added, rounds = base, tuple[str, ...](), Rounds()
    while len(added) < settings.MAX_EFFECTS:
        watch = _of(f"round {len(rounds) + 1}", progress)
        if not budget.allows(f"round {len(rounds) + 1}"):
            break
        found = candidates_of_round(model, budget, watch)
        if not found:
            break
        rounds.append(found)
        if in_wrong_order(rounds[-1]) and budget.allows("the full order"):
            full = _in_full_order(base, progress)
            if full is not None:
                return forward_selection(full, budget, progress)
        best = rounds[-1][0]
        if not best.accepted or best.refit is None:
            break
        before, earlier = model, added
        grown = with_stiffness_growth(best.refit)
        added = (*added, best.effect)
        model, added = (grown, added) if budget.over else pruned(polished(grown), added)
        if not added:
            better = with_stiffness_growth(polished(model))
            return forward_selection(better, budget, progress) if better.cost < base.cost else (base, base, (), rounds)
        if set(added) <= set(earlier):
            break
        p = null_probability(before, best.refit, best.effect, best.doubtful, budget, watch)
        if p is None:
            continue
        rounds[-1] = (judged_by_chance(best, p), *rounds[-1][1:])
        if not rounds[-1][0].accepted:
            model, added = before, earlier
            break
    return base, model, added, rounds


def _in_full_order(base: Model, progress: Progress) -> Model | None:
    """The base model fitted in full order; None where it cannot be."""
    data = base.data
    watch = _of("base model in full order", progress)
    try:
        return base_model(data.experiments, data.held_out_experiments, data.given, data.catalogue, watch, order="full")
    except NegativeAnswer:
        return None


def _reconsidered(
    model: Model, added: tuple[str, ...], rounds: Rounds, budget: Budget
) -> tuple[Model, tuple[str, ...], tuple[Candidate, ...], tuple[str, ...]]:
    """The model and its effects once nothing is left to add, the candidates of the first round as that leaves them, and
    the effects that cannot be told from the first.
    """
    if not added:
        return model, added, rounds[0] if rounds else (), ()
    if len(added) == 1:
        return model, added, *one_accepted(rounds[0], added[0])
    if not budget.allows("other effects in the place of each"):
        return model, added, *several_accepted(rounds, added)
    rivals = {some[0].effect: [c for c in some[1:] if c.refit is not None] for some in rounds}
    model, final, alike = swapped(model, added, rivals, catalogue=model.data.catalogue)
    return model, final, in_the_end(rounds[0], added, final), alike[final[0]]


def _parts(
    recordings: Sequence[Recording], holdout: Sequence[Recording], report_on: Sequence[Recording], hold: bool
) -> Parts:
    """What is fitted, what chooses and what the errors are reported on: recordings of their own, or a last part of
    each. What is held out is divided, where nothing else reports.
    """
    fitted, held_out, report = ([experiment(r, hold=hold) for r in some] for some in (recordings, holdout, report_on))
    if len({e.causality for e in (*fitted, *held_out, *report)}) != 1:
        raise BadInput("recordings", "in some the force drives and in some the motion", "trace them separately")
    if not held_out:
        fitted, held_out = divided(fitted, settings.HELD_OUT_SHARE)
    if not report:
        first, last = divided(held_out, settings.HELD_OUT_SHARE)
        if all(e.segments for e in (*first, *last)):  # none of them is too short for both
            held_out, report = first, last
    return Parts(fitted, held_out, report)


def _check(experiments: Sequence[Experiment], given: Mapping[str, float], catalogue: Catalogue) -> None:
    """Raise BadInput or NegativeAnswer for what no fit could be made with, before any work is done."""
    valve = kernel(BASE, "force", catalogue)
    force = np.concatenate([s.u for e in experiments for s in e.segments])
    check_given(given, valve)
    hindered = obstacle(experiments, Coordinates.of(valve, given, float(np.std(force)) or 1.0), force)
    if hindered is not None:
        raise NegativeAnswer(hindered.value)


def _of(part: str, progress: Progress) -> Progress:
    """Progress that says of which part of the work a stage is."""
    return lambda stage, done, total: progress(f"{part}: {stage}", done, total)
