"""All candidates of one round: screened, fitted as far as each is worth, judged and ranked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.budget import Budget
from identification.tracing.classes import ranked
from identification.tracing.judge import NO_TIME, Candidate, judge, not_fitted, not_refitted
from identification.tracing.models.model import Model
from identification.tracing.refine import worth_refitting
from identification.tracing.screen import screen
from identification.tracing.shortlist import shortlisted_fits
from recordings import Progress, silent


def candidates_of_round(model: Model, budget: Budget, progress: Progress = silent) -> tuple[Candidate, ...]:
    """All candidates beside a model, best first; at most the first is accepted."""
    scores = screen(model, progress)
    fits = shortlisted_fits(model, scores, budget, progress)
    fits.sort(key=lambda fit: -fit.gain if fit.chunk_fits else np.inf)
    chosen = list(worth_refitting(model, fits).values())
    shown = budget.within(chosen, "refits and hold-out", progress, lambda fit: fit.effect)
    refits = {fit.effect: judge(model, fit) for fit in shown}
    judged = [refits.get(fit.effect) or not_refitted(fit) for fit in fits]
    others = [not_fitted(s) for s in scores if all(fit.score is not s for fit in fits)]
    found = (*ranked(judged, model.data.catalogue), *others)
    return tuple(replace(c, why=NO_TIME) if c.effect in budget.not_tried else c for c in found)
