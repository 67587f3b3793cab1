"""What recordings are like: several at once, gaps, missing samples, uneven time, pressure, other units, constants."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from seeded_valves import QUIET, changed, kept, made, moved, recorded, scores

from identification import Outcome, experiment, fit, identify, uncertainty_of
from recordings import BadInput, Plant, Recording, Signal
from simulator import random_valve

SEED = 3
TRUTH, STROKE = random_valve(SEED)


def recovered(*recordings: Recording, at_most: float = 4.5, **options: object) -> dict[str, float]:
    """Fit, and check that it converged to the truth within its own standard deviations; the values."""
    found = identify(recordings, check=False, **options)
    assert found.fit.outcome is Outcome.CONVERGED
    worst = max(scores(found.fit, found.uncertainty, TRUTH).items(), key=lambda item: abs(item[1]))
    assert abs(worst[1]) < at_most, worst
    return found.fit.values


@pytest.fixture(scope="module")
def plain() -> Recording:
    return recorded(SEED)


@pytest.mark.slow
def test_several_recordings_share_their_parameters_and_narrow_them(plain):
    other = recorded(SEED, "staircase:10,sine:10")
    alone = uncertainty_of(fit([experiment(plain)]))
    prepared = [experiment(r) for r in (plain, other)]
    together = fit(prepared)
    known = uncertainty_of(together)
    assert together.outcome is Outcome.CONVERGED
    assert together.rms == pytest.approx(1.0, abs=0.05)
    assert max(abs(z) for z in scores(together, known, TRUTH).values()) < 4.5
    narrower = [known.spread[name] / alone.spread[name] for name in known.names]
    assert np.median(narrower) < 0.95


def test_a_recording_that_starts_elsewhere_gets_its_own_initial_state(plain):
    """Cut in the middle of its motion: position, velocity and bristles are not at rest there."""
    moving = int(np.argmax(np.abs(np.gradient(plain["position"].values))))
    late = kept(plain, np.arange(len(plain)) >= moving)
    recovered(late, plain)


def test_gaps_in_time_cut_the_recording_and_nothing_is_invented(plain):
    keep = np.ones(len(plain), bool)
    keep[3000:3700] = keep[6000:6020] = False
    gapped = kept(plain, keep)
    assert len(experiment(gapped).segments) == 3
    assert experiment(gapped).samples == keep.sum()
    recovered(gapped)


@pytest.mark.parametrize("seed", [1, 5])
def test_bristles_bent_by_a_millimetre_at_a_gap_are_found(seed):
    """Soft packings: the deflection at break-away, fs/sigma0, exceeds 1 mm, and every segment starts inside it."""
    recording, truth = recorded(seed), random_valve(seed)[0]
    assert truth["lugre.fs"] / truth["lugre.sigma0"] > 1e-3
    keep = np.ones(len(recording), bool)
    keep[3000:3700] = keep[6000:6020] = False
    found = fit([experiment(kept(recording, keep))])
    assert found.outcome is Outcome.CONVERGED
    assert found.rms == pytest.approx(1.0, abs=0.05)
    assert max(abs(z) for z in scores(found, uncertainty_of(found), truth).values()) < 4.5


def test_missing_positions_are_masked(plain):
    position = plain["position"].values.copy()
    position[2000:2300] = np.nan
    position[5000::7] = np.nan
    holed = changed(plain, position=position)
    (segment,) = experiment(holed).segments
    assert segment.seen.sum() == np.isfinite(position).sum()
    recovered(holed)


def test_what_is_written_where_a_position_is_missing_does_not_matter(plain):
    """A masked sample has no say: the same fit, whatever the smoothing bridged."""
    position = plain["position"].values.copy()
    position[4000:4100] = np.nan
    first = fit([experiment(changed(plain, position=position))])
    keep = np.isfinite(position)
    segments = experiment(changed(plain, position=position)).segments
    assert np.all(segments[0].seen == keep)
    residual = first.problem.residual(0, first.problem.responses(first.minimum.unknowns, first.minimum.setting)[0])
    assert np.all(residual[~keep] == 0.0)


def test_missing_forces_cut_the_recording(plain):
    force = plain["force"].values.copy()
    force[2000:2100] = np.nan
    force[7000] = np.nan
    holed = changed(plain, force=force)
    assert [len(s.t) for s in experiment(holed).segments] == [2000, 4900, 3000]
    recovered(holed)


def test_uneven_time_is_respected():
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.uniform(0.5, 1.5, 10000) / 500.0)
    plain = recorded(SEED)
    force = np.interp(t, plain.time, plain["force"].values)
    rest = (force[0] - TRUTH["spring.F0"]) / TRUTH["spring.K"]
    position = moved(TRUTH, t, force, rest) + rng.normal(0.0, QUIET * STROKE, len(t))
    jittered = made(t, force, position, stroke_m=STROKE)
    assert experiment(jittered).noise_position == pytest.approx(QUIET * STROKE, rel=0.05)
    recovered(jittered)


@pytest.mark.slow
def test_a_held_force_is_told_from_one_that_changes_steadily():
    plain = recorded(SEED)
    t, force = plain.time, plain["force"].values
    rest = (force[0] - TRUTH["spring.F0"]) / TRUTH["spring.K"]
    noise = np.random.default_rng(6).normal(0.0, QUIET * STROKE, len(t))
    held = made(t, force, moved(TRUTH, t, force, rest, hold=True) + noise)
    right = identify([held], hold=True)
    assert right.fit.outcome is Outcome.CONVERGED
    assert right.fit.rms == pytest.approx(1.0, abs=0.05)
    assert max(abs(z) for z in scores(right.fit, right.uncertainty, TRUTH).values()) < 4.5
    assert right.crosscheck is not None
    assert right.crosscheck.agrees
    assert fit([experiment(held)]).rms > 1.5


def test_constants_of_the_plant_are_held_and_nominal_ones_are_not(plain):
    plant = Plant(
        stroke_m=STROKE, moving_mass_kg=TRUTH["mass.m"], spring_constant_N_per_m=2 * TRUTH["spring.K"],
        spring_preload_N=0.0,
    )  # fmt: skip
    found = identify([replace(plain, plant=plant)], check=False)
    assert found.model.parameters["mass.m"].status == "given"
    assert found.model.parameters["mass.m"].value == TRUTH["mass.m"]
    assert found.model.parameters["mass.m"].std is None
    assert found.model.parameters["spring.K"].status == "identified"
    assert found.fit.values["spring.K"] == pytest.approx(TRUTH["spring.K"], rel=1e-3)


def test_what_is_given_goes_before_what_the_recording_says(plain):
    wrong = replace(plain, plant=Plant(moving_mass_kg=9.0))
    given = {"mass.m": TRUTH["mass.m"], "lugre.fc": TRUTH["lugre.fc"]}
    values = recovered(wrong, given=given)
    assert values["mass.m"] == TRUTH["mass.m"]
    assert values["lugre.fc"] == TRUTH["lugre.fc"]


@pytest.mark.parametrize("name", ["pressure in kPa, position in mm", "force in kN, position in %"])
def test_units_and_pressure_are_only_another_way_to_say_it(plain, name):
    area, t = 0.03, plain["time"]
    position, force = plain["position"].values, plain["force"].values
    if name.startswith("pressure"):
        signals = [
            t,
            Signal("pressure", force / area / 1e3, "kPa", "input"),
            Signal("position", position * 1e3, "mm", "output"),
        ]
    else:
        signals = [
            t,
            Signal("force", force / 1e3, "kN", "input"),
            Signal("position", position / STROKE * 100, "%", "output"),
        ]
    with_plant = experiment(Recording.of(signals, plant=Plant(stroke_m=STROKE, diaphragm_area_m2=area)))
    same = experiment(plain)
    assert np.allclose(with_plant.segments[0].u, same.segments[0].u, rtol=1e-12)
    assert np.allclose(with_plant.segments[0].y, same.segments[0].y, rtol=1e-12, atol=1e-15)
    assert with_plant.noise_position == pytest.approx(same.noise_position, rel=1e-6)


def test_pressure_times_area_is_fitted(plain):
    signals = [
        plain["time"],
        Signal("pressure", plain["force"].values / 0.03 / 1e3, "kPa", "input"),
        Signal("position", plain["position"].values * 1e3, "mm", "output"),
    ]
    recovered(Recording.of(signals, plant=Plant(stroke_m=STROKE, diaphragm_area_m2=0.03)))


@pytest.mark.parametrize(
    ("names", "plant", "words"),
    [
        (("time", "force"), Plant(), "no signal named position"),
        (("time", "position"), Plant(), "there is no force"),
        (("time", "position", "pressure"), Plant(), "a pressure but no /plant diaphragm_area_m2"),
    ],
)
def test_what_a_fit_needs_is_named_when_it_is_not_there(plain, names, plant, words):
    pressure = Signal("pressure", plain["force"].values / 0.03, "Pa", "input")
    there = {"pressure": pressure, **plain.signals}
    with pytest.raises(BadInput, match=words) as refused:
        experiment(Recording.of([there[name] for name in names], plant=plant))
    assert refused.value.remedy


def test_a_position_in_percent_needs_the_stroke(plain):
    percent = Signal("position", plain["position"].values / STROKE * 100, "%", "output")
    with pytest.raises(BadInput, match="stroke"):
        experiment(Recording.of([plain["time"], plain["force"], percent]))


def test_nothing_long_enough_between_gaps_is_refused(plain):
    keep = np.zeros(len(plain), bool)
    for first in range(0, 5000, 1000):
        keep[first : first + 15] = True
    with pytest.raises(BadInput, match="no stretch of"):
        experiment(kept(plain, keep))


def test_recordings_of_different_causality_are_refused(plain):
    imposed = [plain["time"], replace(plain["position"], role="input"), replace(plain["force"], role="output")]
    with pytest.raises(BadInput, match="some are force-driven and some motion-driven"):
        fit([experiment(plain), experiment(Recording.of(imposed))])


@pytest.mark.parametrize(
    ("given", "words"),
    [({"mass.q": 1.0}, "no such parameter"), ({"lugre.fc": -5.0}, "no valve has -5")],
)
def test_what_cannot_be_given_is_refused(plain, given, words):
    with pytest.raises(BadInput, match=words):
        fit([experiment(plain)], given=given)
