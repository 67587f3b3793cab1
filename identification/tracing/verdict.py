"""What a trace found, and whether it deserves a name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.data.experiment import Experiment
from identification.tracing import settings
from identification.tracing.judge import Candidate
from identification.tracing.models.comparison import (
    Whiteness,
    fitted_whiteness,
    held_out_whiteness,
    is_white,
    whiteness_of_all,
)
from identification.tracing.models.model import Model

BASE_MODEL = "the rest of the fit of the base model"
"""What was not tried where the budget of time was over before the base model was fitted."""


@dataclass(frozen=True)
class Selection:
    """Everything that forward selection found.

    base, final : models before and after; candidates : of the first round, best first; added : effects, the one first
    without which the model loses most, empty where none is named; same_class : effects that these recordings cannot
    tell from the first; verdict : an effect id, ``none`` or ``unlisted``; before, after : whether the innovations of
    the two models are noise, on the held-out recordings; report_experiments : neither fitted nor held out; not_tried :
    what there was no time for.
    """

    base: Model
    final: Model
    candidates: tuple[Candidate, ...]
    added: tuple[str, ...]
    same_class: tuple[str, ...]
    verdict: str
    before: Whiteness
    after: Whiteness
    report_experiments: tuple[Experiment, ...] = ()
    not_tried: tuple[str, ...] = ()

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """The experiments that were fitted."""
        return self.base.data.experiments

    @property
    def held_out_experiments(self) -> tuple[Experiment, ...]:
        """The experiments that were held out."""
        return self.base.data.held_out_experiments

    @property
    def only_held_out(self) -> bool:
        """Whether the held-out recordings alone hold more than noise beside the final model."""
        return fitted_whiteness(self.final).white and not self.after.white

    @property
    def complete_if_fitted_to_all(self) -> bool:
        """Whether nothing is missing, but only with parameters that are fitted to the held-out recordings, too."""
        return self.verdict == "none" and not is_white(self.base)


def concluded(
    base: Model, model: Model, added: tuple[str, ...], candidates: Sequence[Candidate], same_class: tuple[str, ...]
) -> Selection:
    """The verdict: effects are named only if hardly anything is missing with them, on the held-out grids above all."""
    some, before, after = tuple(candidates), held_out_whiteness(base), held_out_whiteness(model)
    if added and _deserves_name(base, model, len(added)):
        return Selection(base, model, some, added, same_class, added[0], before, after)
    complete = None if added else before if is_white(base) else whiteness_of_all(base)
    if complete is not None:
        return Selection(base, base, some, (), (), "none", complete, complete)
    return Selection(base, base, some, (), (), "unlisted", before, before)


def _deserves_name(base: Model, model: Model, effects: int) -> bool:
    """Whether so many effects explain enough of what the base model does not."""
    before, after = held_out_whiteness(base), held_out_whiteness(model)
    fitted = fitted_whiteness(base), fitted_whiteness(model)
    if base.data.imposed:
        share = settings.EXPLAINED_FITTED
        return _explained(before, after, share) and _explained(*fitted, share) and after.loss < np.inf
    most = settings.MAX_LOSS_ONE if effects == 1 else settings.MAX_LOSS_SEVERAL
    enough = _explained(before, after, settings.EXPLAINED) and _explained(*fitted, settings.EXPLAINED_FITTED)
    return enough and after.excess < most - settings.COMPLETE_LOSS


def _explained(before: Whiteness, after: Whiteness, share: float) -> bool:
    """Whether that share of the excess loss is gone, or nothing but noise is left."""
    return after.white or after.excess < (1.0 - share) * before.excess
