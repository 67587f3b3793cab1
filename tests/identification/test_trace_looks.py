"""Which candidates a round looks at: more than refits along the model's paths only where those leave it open."""

from __future__ import annotations

from traced_valves import traced

from identification.tracing.refine import KEPT, Begun, gain_of, near, refitted
from identification.tracing.screen import screen
from identification.tracing.shortlist import imitated, looked


def test_where_nothing_is_left_and_nothing_gains_none_is_sought_that_can_be_refitted():
    base = traced(None).tracing.base
    seen = looked(base, screen(base))
    assert all(imitated(base, b.score) for b in seen if b.ends)


def test_beside_what_explains_all_only_that_is_sought_which_gains_about_as_much():
    base = traced("hardening_spring", k3=3e6).tracing.base
    seen = looked(base, screen(base))
    most = max(gain_of(base, b.near) for b in seen)
    sought = [b for b in seen if b.ends]
    assert "hardening_spring" in [b.score.effect for b in sought]
    assert len(sought) < len(seen)
    assert all(max(b.score.gain, gain_of(base, b.near)) > KEPT * most for b in sought)


def test_a_refit_ends_early_beside_one_that_gains_far_more():
    base = traced("hardening_spring", k3=3e6).tracing.base
    spring = next(s for s in screen(base) if s.effect == "hardening_spring")
    whole, short = near(base, spring), near(base, spring, beside=1e9)
    assert gain_of(base, whole) > gain_of(base, short) + 100


def test_what_gains_enough_along_the_models_paths_is_not_refitted_along_others():
    base = traced("hardening_spring", k3=3e6).tracing.base
    spring = next(s for s in screen(base) if s.effect == "hardening_spring")
    elsewhere, short = near(base, spring), near(base, spring, beside=1e9)
    promised = gain_of(base, short) * base.data.in_chunks
    assert refitted(base, Begun(spring, (elsewhere,), 0.9 * promised, near=short)) is short
    assert gain_of(base, refitted(base, Begun(spring, (elsewhere,), 1.1 * promised, near=short))) > gain_of(base, short)
