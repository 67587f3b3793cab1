"""Of several effects each is swapped for the simplest that explains as much beside the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import pytest
from traced_valves import traced

from identification.tracing.classes import one_accepted
from identification.tracing.swap import swapped


@dataclass
class Fitted:
    """Stands for a model: its cost, and the models in which one effect is swapped for another."""

    cost: float
    others: Mapping[tuple[str, str], Fitted | None] = field(default_factory=dict)

    def swapped(self, effect: str, other: str, _: Mapping[str, float], below: float) -> Fitted | None:
        return self.others[effect, other]


def rivals(*effects: str) -> list[SimpleNamespace]:
    return [SimpleNamespace(effect=effect, values={}) for effect in effects]


ADDED = ("flow_force", "friction_drift")


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
    model, names, same = swapped(bump, ADDED, tried, margin=60.0)
    assert names == added
    assert same == alike
    assert model is (spring if "hardening_spring" in added else bump)


def test_an_effect_found_beside_the_first_one_stands_first_where_it_alone_is_left():
    first = traced("hardening_spring", k3=3e6).selection.candidates[0]
    alike = replace(first, effect="flow_force", accepted=False)
    worse = replace(first, effect="quadratic_drag", accepted=False, gain=0.5 * first.gain)
    assert one_accepted((first, alike, worse), first.effect) == ((first, alike, worse), ("flow_force",))
    candidates, others = one_accepted((first, alike, worse), "flow_force")
    assert ([c.effect for c in candidates if c.accepted], candidates[0].effect) == (["flow_force"], "flow_force")
    assert others == ("hardening_spring",)
    candidates, others = one_accepted((first, alike, worse), "quadratic_drag")
    assert (candidates[0].effect, others) == ("quadratic_drag", ())
