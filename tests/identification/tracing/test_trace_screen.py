"""The score test of tracing: effects of one's own are tried as those of the catalogue are, and the work is reported."""

from __future__ import annotations

from dataclasses import replace

import pytest
from traced_valves import traced

from identification.tracing import settings
from identification.tracing.models.guesses import guesses, looks, shapes, sizes
from identification.tracing.screen import Score, best_score, screen
from simulator import CATALOGUE, Effect, Memory, Parameter, Site


class OwnSpring(Effect):
    """Force = k3 x^3, as that of the hardening spring, by another name."""

    id = "own_spring"
    site = Site.FORCE
    sentence = "the spring stiffens along the stroke"
    parameters = (Parameter("k3", "N/m3", "cubic stiffness", scale=5e6, neutral=0.0),)

    def force(self, q, p, s, ds):
        return p["k3"] * q.x**3


class OwnShape(Effect):
    """An effect whose guess names a shape, and that works through memory."""

    id = "own_shape"
    site = Site.FORCE
    sentence = "anything"
    parameters = (
        Parameter("strength", "m", "strength", 1e-4, lower=0.0, neutral=0.0),
        Parameter("here", "m", "position", 0.01),
        Parameter("w", "m", "not guessed", 0.03, lower=0.0, positive=True),
    )
    memory = (Memory("z", "m"),)

    def first_guess(self, recordings, base):
        return [self.named(strength=3e-4, here=0.02), self.named(strength=3e-4, here=0.02)]


def test_an_effect_of_ones_own_has_the_score_of_its_physics_and_the_work_is_reported():
    base = traced("hardening_spring", k3=3e5).selection.base
    both = ("hardening_spring", "own_spring")
    own = replace(base, data=replace(base.data, catalogue=CATALOGUE.extended(OwnSpring()), candidates=both))
    stages: list[tuple[str, int, int]] = []
    first, second = screen(own, lambda *stage: stages.append(stage))
    assert {first.effect, second.effect} == {*both}
    assert second.gain == pytest.approx(first.gain, rel=1e-6)
    assert stages == [("score test", done, 2) for done in (0, 1, 2)]


def test_parameters_are_tried_where_the_guess_says_and_else_at_their_scales():
    base = traced("hardening_spring", k3=3e5).selection.base
    data = replace(base.data, catalogue=CATALOGUE.extended(OwnShape()))
    found = guesses(replace(base, data=data), looks(base), "own_shape")
    full, damped = (replace(data, damped=freedom) for freedom in (None, settings.PATH_FREEDOM))
    guessed, typical = ({"own_shape.here": here, "own_shape.w": 0.03} for here in (0.02, 0.01))
    assert shapes(full, "own_shape", found) == [guessed]
    assert shapes(damped, "own_shape", found) == [guessed, typical]
    tried = [{"own_shape.strength": s} for s in (3e-4, pytest.approx(1e-5), 1e-4)]
    assert sizes(full, "own_shape", found) == tried[:2]
    assert sizes(damped, "own_shape", found) == tried
    assert shapes(full, "own_shape", []) == shapes(damped, "own_shape", []) == [typical]


def test_a_score_keeps_the_next_shape_that_promises_as_much(monkeypatch: pytest.MonkeyPatch):
    base = traced("hardening_spring", k3=3e5).selection.base
    gains = {0.02: 100.0, 0.01: 60.0, 0.03: 80.0, 0.04: 20.0}

    def scored(_model, effect, shape, _size):
        return Score(effect, gains[shape["own_shape.here"]], shape)

    data = replace(base.data, catalogue=CATALOGUE.extended(OwnShape()), damped=None)
    own = replace(base, data=data)
    monkeypatch.setattr("identification.tracing.screen._score", scored)
    found = best_score(own, "own_shape", [{"own_shape.here": here} for here in gains])
    assert found.values["own_shape.here"] == 0.02
    assert [values["own_shape.here"] for values in found.others] == [0.03]
    alone = best_score(own, "own_shape", [{"own_shape.here": here} for here in (0.02, 0.04)])
    assert alone.others == ()
