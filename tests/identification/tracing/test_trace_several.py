"""Of several effects: what is needed, most first, and the simplest that explains as much in the place of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from traced_valves import traced

from identification.tracing.classes import one_accepted, same_class, several_accepted
from identification.tracing.judge import Candidate
from identification.tracing.models.comparison import Comparison
from identification.tracing.several import pruned, swapped

T = np.linspace(0.0, 10.0, 1001)
"""Times of the held-out recording [s]."""


def left(size: float, first: float = 0.0) -> SimpleNamespace:
    """An estimate on the held-out recording whose innovations have a standard deviation of so many units. first : the
    first innovation.
    """
    innovations = np.random.default_rng(1).normal(0.0, size, (len(T), 2))
    innovations[0] = first or innovations[0]
    line = SimpleNamespace(scored=(innovations, np.ones_like(innovations)))
    return SimpleNamespace(linearised=(line,), tuning=np.inf)


@dataclass(eq=False)
class Fitted:
    """Stands for a model: its cost, and the models in which an effect is swapped for another, or left out."""

    cost: float
    others: Mapping[str | tuple[str, str], Fitted | None] = field(default_factory=dict)
    held_out: SimpleNamespace | None = field(default_factory=lambda: left(1.0))
    data: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(held_out=(SimpleNamespace(t=T),)))

    def swapped(self, effect: str, other: str, _: Mapping[str, float], below: float) -> Fitted | None:
        return self.others[effect, other]

    def without(self, effect: str) -> Fitted | None:
        return self.others[effect]


def rivals(*effects: str) -> list[SimpleNamespace]:
    return [SimpleNamespace(effect=effect, values={}) for effect in effects]


ADDED = ("flow_force", "friction_drift")


@pytest.mark.parametrize(
    ("spring", "drift", "order"),
    [
        (Fitted(400.0), Fitted(500.0), ("friction_drift", "flow_force")),
        (Fitted(500.0), Fitted(400.0), ADDED),
        (Fitted(500.0), None, ("friction_drift", "flow_force")),
    ],
    ids=["the second", "the first", "there is no model without it"],
)
def test_the_effect_without_which_most_is_lost_comes_first(spring, drift, order):
    """It is the verdict: what imitated it was accepted first, and is hardly needed any more."""
    both = Fitted(0.0, {"flow_force": spring, "friction_drift": drift})
    assert pruned(both, ADDED) == (both, order)


def test_what_is_needed_least_is_dropped_one_by_one_while_nothing_is_lost():
    base = Fitted(4000.0)
    drift = Fitted(30.0, {"friction_drift": base})
    both = Fitted(20.0, {"flow_force": drift, "friction_drift": Fitted(70.0)})
    three = Fitted(0.0, {"flow_force": Fitted(50.0), "friction_drift": Fitted(900.0), "dwell_stiction": both})
    assert pruned(three, (*ADDED, "dwell_stiction")) == (drift, ("friction_drift",))
    assert pruned(Fitted(0.0, {"flow_force": base}), ("flow_force",))[1] == ("flow_force",)
    assert pruned(Fitted(3950.0, {"flow_force": base}), ("flow_force",)) == (base, ())


@pytest.mark.parametrize(
    ("cost", "added", "alike"),
    [
        (-177.0, ("hardening_spring", "friction_drift"), ()),
        (+20.0, ("hardening_spring", "friction_drift"), ("flow_force",)),
        (+100.0, ADDED, ()),
    ],
)
def test_the_simplest_of_those_that_explain_alike_stays(cost, added, alike):
    spring = Fitted(cost, {("friction_drift", "dwell_stiction"): None})
    bump = Fitted(0.0, {("flow_force", "hardening_spring"): spring, ("friction_drift", "dwell_stiction"): None})
    tried = {"flow_force": rivals("hardening_spring", "friction_drift"), "friction_drift": rivals("dwell_stiction")}
    model, names, same = swapped(bump, ADDED, tried)
    assert names == added
    assert same == {added[0]: alike, added[1]: ()}
    assert model is (spring if "hardening_spring" in added else bump)


@pytest.mark.parametrize(
    ("held_out", "stays"),
    [(left(1.5), False), (left(1.0), True), (left(1.01), True), (left(1.0, first=30.0), True), (None, False)],
    ids=["explains less", "as well", "by less than counts", "less in one place", "has no solution there"],
)
def test_what_only_fits_better_is_not_taken(held_out, stays):
    spring = Fitted(-1000.0, {("friction_drift", "dwell_stiction"): None}, held_out)
    bump = Fitted(0.0, {("flow_force", "hardening_spring"): spring, ("friction_drift", "dwell_stiction"): None})
    tried = {"flow_force": rivals("hardening_spring"), "friction_drift": rivals("dwell_stiction")}
    model, names, _ = swapped(bump, ADDED, tried)
    assert (model is spring) == stays
    assert ("hardening_spring" in names) == stays


def test_an_effect_found_beside_the_first_one_stands_first_where_it_alone_is_left():
    first = traced("hardening_spring", k3=3e5).selection.candidates[0]
    alike = replace(first, effect="flow_force", accepted=False)
    worse = replace(first, effect="quadratic_drag", accepted=False, gain=0.5 * first.gain)
    assert one_accepted((first, alike, worse), first.effect) == ((first, alike, worse), ("flow_force",))
    candidates, others = one_accepted((first, alike, worse), "flow_force")
    assert ([c.effect for c in candidates if c.accepted], candidates[0].effect) == (["flow_force"], "flow_force")
    assert others == ("hardening_spring",)
    candidates, others = one_accepted((first, alike, worse), "quadratic_drag")
    assert (candidates[0].effect, others) == ("quadratic_drag", ())


def judged(effect: str, gain: float, size: float) -> Candidate:
    """An accepted candidate with a fitted gain, whose refit leaves innovations of such a size on what is held out."""
    refit = Fitted(0.0, held_out=left(size))
    return Candidate(effect, gain, {}, refit, Comparison(60.0, 3.0, 0.002, 20.0), accepted=True)


@pytest.mark.parametrize(
    ("gain", "size", "alike"),
    [(610.0, 1.0, True), (610.0, 0.9, True), (610.0, 1.2, False), (580.0, 1.0, False)],
    ids=["hardly less fitted", "more held out", "less held out", "less fitted"],
)
def test_candidates_are_one_class_unless_the_best_explains_either_part_better(gain, size, alike):
    """Of one that even explains what is held out better it cannot be said that the best is the right one."""
    candidates = [judged("contact_stiffness", 650.0, 1.0), judged("sensor_nonlinearity", gain, size)]
    assert (same_class(candidates) == ("sensor_nonlinearity",)) is alike


def test_a_class_is_the_same_whichever_of_its_effects_stands_first():
    one, other = judged("contact_stiffness", 1000.0, 1.0), judged("flow_force", 1055.0, 1.0)
    assert same_class([one, other]) == ("flow_force",)
    assert same_class([other, one]) == ("contact_stiffness",)


def test_without_time_to_exchange_effects_the_class_of_the_first_is_that_of_its_round():
    gains = {"contact_stiffness": 650.0, "flow_force": 640.0, "friction_drift": 300.0, "dwell_stiction": 290.0}
    first, alike, other, late = (judged(effect, gain, 1.0) for effect, gain in gains.items())
    rounds = [(first, alike, other), (other, late)]
    some, others = several_accepted(rounds, ("contact_stiffness", "friction_drift"))
    assert [c.effect for c in some] == ["contact_stiffness", "friction_drift", "flow_force"]
    assert others == ("flow_force",)
    assert several_accepted(rounds, ("contact_stiffness", "flow_force"))[1] == ()
    assert several_accepted(rounds, ("friction_drift", "contact_stiffness"))[1] == ("dwell_stiction",)
    assert several_accepted(rounds, ("dead_time", "friction_drift"))[1] == ()
