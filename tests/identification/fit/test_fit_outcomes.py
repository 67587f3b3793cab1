"""Failure is a value with a sentence: what recordings cannot teach, and what no model follows."""

from __future__ import annotations

import numpy as np
import pytest
from seeded_valves import changed, made, moved, recorded

from identification import Outcome, experiment, fit, identify
from recordings import BadInput, NegativeAnswer, Recording, Signal
from simulator import random_valve

SEED = 2
TRUTH, STROKE = random_valve(SEED)


@pytest.fixture(scope="module")
def plain() -> Recording:
    return recorded(SEED)


@pytest.fixture(scope="module")
def short() -> Recording:
    """Long enough to see that nothing explains it, after descents from every start."""
    return recorded(SEED, "mixed:10", 250.0)


def stuck(size: float) -> Recording:
    """A force that moves nothing, and a position that is noise about one place."""
    plain = recorded(SEED)
    noise = size * np.random.default_rng(3).normal(size=len(plain))
    return changed(plain, force=0.01 * plain["force"].values, position=0.01 + noise)


def flickering() -> np.ndarray:
    """A sensor that cannot decide between two of its steps."""
    return 0.01 + 1e-4 * np.random.default_rng(3).integers(0, 2, 10001)


def one_way() -> Recording:
    """A slow push in one direction only, from motion to motion."""
    t = np.arange(5000) / 500.0
    force = TRUTH["spring.F0"] + 1.3 * TRUTH["lugre.fs"] + TRUTH["spring.K"] * STROKE * t / t[-1]
    position = moved(TRUTH, t, force) + 1e-6 * np.random.default_rng(4).normal(size=len(t))
    late = slice(2000, None)
    return made(t[late] - t[2000], force[late], position[late])


def first_samples(n: int) -> Recording:
    plain = recorded(SEED)
    keep = slice(2500, 2500 + n)
    return made(plain.time[:n], plain["force"].values[keep], plain["position"].values[keep])


REFUSED = {
    "a stuck stem": (lambda: stuck(0.0), Outcome.NO_MOTION),
    "a stuck stem and noise": (lambda: stuck(1e-6), Outcome.NO_MOTION),
    "a stuck stem and a coarse sensor": (lambda: changed(stuck(0.0), position=flickering()), Outcome.NO_MOTION),
    "a constant force": (lambda: changed(recorded(SEED), force=np.full(10001, 300.0)), Outcome.CONSTANT_INPUT),
    "one way only": (one_way, Outcome.NO_FRICTION),
    "two dozen samples": (lambda: first_samples(24), Outcome.TOO_SHORT),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_recording_cannot_teach_is_said_and_not_invented(name):
    make, outcome = REFUSED[name]
    found = fit([experiment(make())])
    assert found.outcome is outcome
    assert not found.outcome.usable
    assert found.minimum is None
    with pytest.raises(NegativeAnswer, match=outcome.value):
        identify([make()])


def test_one_way_is_enough_where_the_preload_is_known():
    found = fit([experiment(one_way())], given={name: TRUTH[name] for name in ("mass.m", "spring.K", "spring.F0")})
    assert found.outcome is not Outcome.NO_FRICTION


def test_every_outcome_has_a_sentence_of_its_own():
    sentences = [outcome.value for outcome in Outcome]
    assert len(set(sentences)) == len(sentences)
    for sentence in sentences:
        assert len(sentence.split()) > 2
        assert "\n" not in sentence
    assert Outcome.CONVERGED.usable
    assert not Outcome.DIVERGED.usable


@pytest.mark.slow
@pytest.mark.parametrize("sign", [pytest.param("force", marks=pytest.mark.long), "position"])
def test_an_opposite_sign_is_not_explained(short, sign):
    found = identify([changed(short, **{sign: -short[sign].values})])
    assert found.fit.outcome is Outcome.NOT_EXPLAINED
    assert "signs" in found.fit.outcome.value
    assert all(np.isfinite(p.value) for p in found.model.parameters.values())
    assert all(p.std is None or np.isfinite(p.std) for p in found.model.parameters.values())


def test_swapped_force_and_position_are_not_explained(short):
    found = identify([made(short.time, short["position"].values, short["force"].values)])
    assert found.fit.outcome is Outcome.NOT_EXPLAINED
    assert "roles" in found.fit.outcome.value


def test_a_force_in_another_unit_only_scales_the_valve(plain):
    """Nothing in a fit knows how large a valve may be: twenty times the force is a valve twenty times as strong."""
    one, other = (fit([experiment(changed(plain, force=k * plain["force"].values))]) for k in (1.0, 20.0))
    assert other.outcome is Outcome.CONVERGED
    for name, share in (("mass.m", 0.01), ("spring.K", 1e-3), ("lugre.fc", 1e-3), ("lugre.sigma0", 0.02)):
        assert other.values[name] == pytest.approx(20 * one.values[name], rel=share)
    assert other.values["lugre.vs"] == pytest.approx(one.values["lugre.vs"], rel=0.02)


def test_a_position_that_is_mostly_missing_is_refused(plain):
    position = np.where(np.arange(len(plain)) < 5, plain["position"].values, np.nan)
    with pytest.raises(BadInput, match="no stretch of"):
        fit([experiment(changed(plain, position=position))])


@pytest.mark.slow
def test_numbers_that_overflow_end_in_words(plain):
    """Beyond 1e30 they are no samples. Below, whatever comes out, it is an outcome and not an exception."""
    with pytest.raises(BadInput, match="a sample is a finite number"):
        experiment(changed(plain, force=1e200 * plain["force"].values))
    found = fit([experiment(changed(plain, force=1e25 * plain["force"].values))])
    assert isinstance(found.outcome, Outcome)


@pytest.mark.long
def test_a_plant_that_only_runs_coarsely_sampled_ends_in_an_outcome():
    """A valve signature of some dozen points, one a second, stem on its stops at both ends."""
    x = np.clip(np.concatenate([np.linspace(-0.1, 1.1, 24), np.linspace(1.05, -0.15, 24)]), 0, 1) * STROKE
    pressure = np.concatenate([np.linspace(0.0, 1.0, 24), np.linspace(0.9, -0.1, 24)])
    force = Signal("force", 3000 * pressure, "N", "input")
    signals = [Signal("time", np.arange(48.0), "s", "time"), force, Signal("position", x, "m", "output")]
    found = fit([experiment(Recording.of(signals))], given={"mass.m": 2.0})
    assert isinstance(found.outcome, Outcome)
    if found.outcome.usable:
        assert all(np.isfinite(list(found.values.values())))
