"""A trace within a budget of time, and its three uses of data."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from stiff_valves import stem_test
from traced_valves import imposed, recorded, traced, traced_imposed

from identification import Outcome, identify, trace
from identification.budget import Budget
from identification.tracing import settings
from identification.tracing.algorithm import forward_selection, select
from identification.tracing.answer import sentences
from identification.tracing.candidates import candidates_of_round
from identification.tracing.judge import NO_TIME
from identification.tracing.verdict import BASE_MODEL
from recordings import BadInput, BadParameter, bundled
from simulator import BASE, CATALOGUE, Catalogue


def ticking(calls: int) -> Iterator[float]:
    """A clock [s] that is past any budget after so many looks at it."""
    yield from (0.0 for _ in range(calls))
    yield from (1e6 for _ in count())


def budget_of(calls: int) -> Budget:
    """A budget that is over after so many looks at the time."""
    looks = ticking(calls)
    return Budget(100.0, clock=lambda: next(looks))


@pytest.mark.parametrize(
    ("uses", "said"),
    [
        ({"holdout": ["sine"]}, "it is fitted and held out; what is fitted does not judge"),
        ({"report_on": ["sine"]}, "it is fitted and reported on"),
        ({"holdout": ["mixed"], "report_on": ["mixed"]}, "it is held out and reported on"),
    ],
)
def test_one_measurement_has_one_use_whatever_its_name(uses: dict[str, list[str]], said: str):
    fitted = [bundled("step"), replace(bundled("sine"), title="of another day")]
    with pytest.raises(BadInput, match=said) as refused:
        trace(fitted, **{use: [bundled(name) for name in names] for use, names in uses.items()})
    assert refused.value.parameter in uses


def test_one_measurement_counts_once():
    once = bundled("step")
    for uses in ({"holdout": [once, once]}, {"report_on": [once, once]}):
        with pytest.raises(BadInput, match=r"the same measurement as .*; it would count twice"):
            trace([bundled("sine")], **uses)
    with pytest.raises(BadInput, match="which is fitted already"):
        identify([once, bundled("sine"), replace(once, title="of another day")])


def test_with_no_time_left_the_base_model_is_the_answer():
    base, spent = traced("hardening_spring", k3=3e5).selection.base, budget_of(1)
    _, model, added, rounds = forward_selection(base, spent)
    assert (model, added, rounds) == (base, (), [])
    assert spent.not_tried == ["round 1"]


@pytest.mark.slow
def test_candidates_that_there_was_no_time_for_say_so_and_none_is_lost():
    base, spent = traced("hardening_spring", k3=3e5).selection.base, budget_of(3)
    found = candidates_of_round(base, spent)
    late = {c.effect for c in found if c.why == NO_TIME}
    assert late
    judged = {c.effect for c in found if c.refit is not None}
    assert late == {name for name in spent.not_tried if name in base.data.catalogue.ids} - judged
    assert not any(c.accepted and c.effect in late for c in found)
    assert {c.effect for c in found} == {c.effect for c in candidates_of_round(base, Budget())}


@pytest.mark.slow
def test_the_best_refit_so_far_is_judged_when_the_time_is_over():
    """It is over while the best is refitted, so nothing else is."""
    base, over = traced("hardening_spring", k3=3e5).selection.base, list[str]()
    spent = Budget(100.0, clock=lambda: 1e6 if over else 0.0)
    best = "refits on the base model's paths: hardening_spring"
    found = candidates_of_round(base, spent, lambda stage, *_: over.extend([stage] * stage.startswith(best)))
    assert spent.not_tried
    assert [c.effect for c in found if c.refit is not None] == ["hardening_spring"]
    assert found[0].accepted


def test_the_errors_are_reported_on_what_neither_fitted_nor_judged():
    found = traced_imposed("hardening_spring", k3=3e6)
    held, report = found.selection.held_out_experiments, found.selection.report_experiments
    (judged,), (reported,) = ([s for e in some for s in e.segments] for some in (held, report))
    seen = [int(s.seen.sum()) for s in (judged, reported)]
    assert seen[1] / sum(seen) == pytest.approx(settings.HELD_OUT_SHARE, abs=0.01)
    assert not np.intersect1d(judged.y, reported.y).size


def test_a_trace_whose_time_is_over_in_the_base_model_ends_all_the_same():
    *fitted, held_out = stem_test(100.0, ("staircase:12", "sine:12", "sine:10"))
    short = budget_of(4)
    with short.in_force():
        found = select(fitted, holdout=[held_out], budget=short)
    assert found.not_tried[0] == BASE_MODEL
    assert (found.added, found.verdict) == ((), "unlisted")
    assert found.base.fit.outcome is Outcome.OUT_OF_TIME
    assert "what it lacks is not known" in sentences(found, None, None, 0.0)[0]


def test_less_than_a_second_is_no_budget():
    with pytest.raises(BadParameter, match="budget"):
        trace(recorded()[:1], budget=0.0)
    with pytest.raises(BadParameter, match="budget"):
        Budget(float("nan"))


@pytest.mark.slow
def test_progress_says_the_round_the_candidate_and_the_best_gain_so_far():
    first, second, held = (imposed(r) for r in recorded("hardening_spring", {"hardening_spring.k3": 3e6})[:3])
    tried = ("hardening_spring", "quadratic_drag", "position_dependent_friction", "position_periodic_force")
    few, stages = Catalogue(tuple(CATALOGUE[effect] for effect in (*BASE, *tried))), list[str]()
    found = trace([first, second], holdout=[held], catalogue=few, progress=lambda stage, *_: stages.append(stage))
    gains = {c.effect: c.gain for c in found.candidates if c.refit is not None}
    assert len(gains) > 1
    said = [re.fullmatch(r"round 1: refits and hold-out: (\w+)(?:, best gain (\d+))?", stage) for stage in stages]
    judged, best = zip(*((one[1], one[2]) for one in said if one), strict=True)
    assert best[0] is None
    so_far = [max(gains.get(effect, 0.0) for effect in judged[:i]) for i in range(1, len(judged))]
    assert [int(one) for one in best[1:]] == [round(gain) for gain in so_far]
    assert any(re.fullmatch(r"round 1: fits to chunks: \w+, best gain on chunks \d+", stage) for stage in stages)
