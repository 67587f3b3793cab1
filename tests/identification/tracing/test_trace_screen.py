"""The score test of tracing: effects of one's own are tried as those of the catalogue are, and the work is reported."""

from __future__ import annotations

from dataclasses import replace

import pytest
from identification.tracing.models.scan import rhythms, shapes, sizes
from traced_valves import traced

from identification.tracing.screen import screen
from simulator import CATALOGUE, Effect, Memory, Parameter, Site, TriedAt


class OwnSpring(Effect):
    """Force = k3 x^3, as that of the hardening spring, by another name."""

    id = "own_spring"
    site = Site.FORCE
    sentence = "the spring stiffens along the stroke"
    parameters = (Parameter("k3", "N/m3", "cubic stiffness", scale=5e6, neutral=0.0),)

    def force(self, q, p, s, ds):
        return p["k3"] * q.x**3


class OwnShape(Effect):
    """An effect with every kind of parameter, named as nobody would name them."""

    id = "own_shape"
    site = Site.FORCE
    sentence = "anything"
    parameters = (
        Parameter("strength", "m", "strength", 1e-4, lower=0.0, neutral=0.0, tried_at=TriedAt.NOISE),
        Parameter("here", "m", "position", 0.01, tried_at=TriedAt.POSITIONS),
        Parameter("wide", "m", "width", 0.01, lower=0.0, positive=True, tried_at=TriedAt.WIDTHS),
        Parameter("w", "m", "not scanned", 0.01, lower=0.0, positive=True),
    )
    memory = (Memory("z", "m"),)


def test_an_effect_of_ones_own_has_the_score_of_its_physics_and_the_work_is_reported():
    base = traced("hardening_spring", k3=3e6).selection.base
    both = ("hardening_spring", "own_spring")
    own = replace(base, data=replace(base.data, catalogue=CATALOGUE.extended(OwnSpring()), candidates=both))
    stages: list[tuple[str, int, int]] = []
    first, second = screen(own, lambda *stage: stages.append(stage))
    assert {first.effect, second.effect} == {*both}
    assert second.gain == pytest.approx(first.gain, rel=1e-6)
    assert stages == [("score test", done, 2) for done in (0, 1, 2)]


def test_parameters_are_tried_where_they_say():
    base = traced("hardening_spring", k3=3e6).selection.base
    data = replace(base.data, catalogue=CATALOGUE.extended(OwnShape()))
    tried = list(shapes(data, "own_shape", rhythms(base)))
    assert len({shape["own_shape.here"] for shape in tried}) == 5
    assert len({shape["own_shape.wide"] for shape in tried}) == 2
    assert {shape["own_shape.w"] for shape in tried} == {0.01}
    low, high = data.travel
    assert all(low < shape["own_shape.here"] < high for shape in tried)
    noise = data.fitted[0].noise_y
    assert list(sizes(data, "own_shape")) == [{"own_shape.strength": 4 * noise}, {"own_shape.strength": 16 * noise}]
