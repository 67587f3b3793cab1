"""How well the parameters are known: covariance, condition, collinear pairs, statuses, advice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from seeded_valves import QUIET, changed, fitted, recorded, scores

from benchmarks.plant_sampling import recordings as stiff_recordings
from identification import Identification, experiment, fit, identify, uncertainty_of
from simulator import Excitation, Sensors, random_valve, simulate

STATUSES = {"identified", "weak", "unresolved", "at_bound", "given"}
EXPERIMENTS = {"mass.m": "multisine", "lugre.sigma1": "presliding", "lugre.vs": "slow", "lugre.sigma2": "speeds"}
COARSE = 60 * QUIET
"""Noise of a position that hides the Stribeck velocity from every test."""
POOR = 7
"""The valve of the poor recording."""


@pytest.fixture(scope="module")
def rich() -> Identification:
    return identify([recorded(2)], check=False)


@pytest.fixture(scope="module")
def poor() -> Identification:
    """A stroke up and down at one speed, sampled at 50 Hz: spring and preload, and little more. Mass and viscous
    friction show only when the valve starts, each in the place of the other.
    """
    return identify([recorded(POOR, "ramp:20", 50.0, 0.5 * QUIET)], check=False)


def test_a_rich_recording_identifies_everything(rich):
    known = rich.uncertainty
    assert set(known.status.values()) == {"identified"}
    assert known.condition < 100
    assert known.pairs() == []
    assert rich.advice == ()
    assert known.inflation == pytest.approx(1.0, abs=0.35)


def test_a_poor_recording_says_what_it_does_not_know(poor):
    known, values = poor.uncertainty, poor.fit.values
    truth = random_valve(POOR)[0]
    assert known.status["spring.K"] == "identified"
    assert known.status["mass.m"] == "weak"
    assert known.condition > 1000
    for name in known.names:
        relative = known.spread[name] / abs(values[name])
        if known.status[name] == "identified":
            assert relative <= 0.3
            assert abs(values[name] - truth[name]) < 5 * known.std[name]
    assert values["spring.K"] == pytest.approx(truth["spring.K"], rel=1e-3)


def test_every_number_is_finite_however_little_is_known(poor):
    assert all(np.isfinite(poor.uncertainty.spread[name]) for name in poor.uncertainty.names)
    assert np.isfinite(poor.uncertainty.condition)
    assert np.isfinite(poor.uncertainty.inflation)
    assert np.isfinite(poor.uncertainty.correlation).all()


def test_collinear_parameters_are_named_with_their_partner(poor):
    known = poor.uncertainty
    pairs = known.pairs()
    assert pairs
    assert all(abs(c) <= 1 + 1e-9 and abs(c) > 0.95 for _, _, c in pairs)
    assert [abs(c) for _, _, c in pairs] == sorted((abs(c) for _, _, c in pairs), reverse=True)
    noted = {name: words for name, words in known.note.items() if "collinear" in words}
    assert noted
    for name, words in noted.items():
        assert known.status[name] == "weak"
        assert any(other in words for other in known.names if other != name)
    assert poor.model.quality["correlated"][0].split(":")[0] == f"{pairs[0][0]}, {pairs[0][1]}"


def test_advice_names_an_experiment_for_weak_parameters(poor):
    """In their order, but for those that no experiment would tell, as the damping of bristles that a stroke hardly
    bends.
    """
    known = poor.uncertainty
    weak = [name for name in known.names if known.status[name] in ("weak", "at_bound")]
    advised = [name for name in weak if any(sentence.startswith(f"{name}: ") for sentence in poor.advice)]
    assert {"mass.m", "lugre.vs", "lugre.sigma2"} <= set(advised)
    for name, sentence in zip(advised, poor.advice, strict=True):
        assert sentence.startswith(f"{name}: ")
        assert "record " in sentence
        assert sentence.endswith(".")
        assert EXPERIMENTS.get(name, "") in sentence


@pytest.mark.slow
def test_advice_is_given_only_where_the_experiment_would_help(poor):
    """The same stroke with coarse positions: what is advised for the Stribeck velocity would not tell it there. Where
    so little is known the last digit of a sum decides where a fit ends, so most of some fits are asked.
    """
    assert any(sentence.startswith("lugre.vs: ") for sentence in poor.advice)
    levels = [factor * QUIET for factor in (40, 50, 60, 80, 100)]
    coarse = [identify([recorded(POOR, "ramp:20", 50.0, noise)], check=False) for noise in levels]
    truth = random_valve(POOR)[0]["lugre.vs"]
    errors = [abs(one.fit.values["lugre.vs"] - truth) / one.uncertainty.spread["lugre.vs"] for one in coarse]
    weak = [one.uncertainty.status["lugre.vs"] == "weak" for one in coarse]
    assert sum(told or error < 3 for told, error in zip(weak, errors, strict=True)) >= len(coarse) - 1
    advised = {
        name: sum(any(sentence.startswith(f"{name}: ") for sentence in one.advice) for one in coarse)
        for name in ("mass.m", "lugre.vs")
    }
    assert advised["lugre.vs"] < len(coarse) / 2 < advised["mass.m"]


@pytest.mark.parametrize(("noise", "told"), [pytest.param(0.5 * QUIET, True, marks=pytest.mark.slow), (COARSE, False)])
def test_what_advice_promises_comes_true(noise, told):
    """The advised steps and slow ramps recorded beside the stroke, as advice would have them or not."""
    runs = [recorded(POOR, course, 50.0, noise) for course in ("ramp:20", "staircase:10,ramp:20")]
    known = uncertainty_of(fit([experiment(run) for run in runs]))
    assert (known.status["lugre.vs"] == "identified") is told


@pytest.mark.slow
def test_a_model_that_swings_by_itself_tells_nothing():
    """Coarse positions let a fit end with a stem that hunts: what a free run does then, its start decides, and its
    derivatives grow thirtyfold in a second. No parameter is known by that."""
    known = identify([recorded(POOR, "ramp:20", 50.0, COARSE)], check=False).uncertainty
    assert min(known.spread[name] for name in known.names) > 1e-6
    assert known.status["lugre.sigma1"] != "identified"


def test_the_correlation_matrix_is_one(rich, poor):
    for found in (rich, poor):
        c = found.uncertainty.correlation
        assert c.shape == (len(found.uncertainty.names),) * 2
        assert np.allclose(np.diag(c), 1.0)
        assert np.allclose(c, c.T)
        assert np.all(np.abs(c) <= 1 + 1e-9)


@pytest.mark.slow
def test_a_parameter_at_zero_is_at_its_bound():
    values, stroke = random_valve(2)
    values["lugre.sigma2"] = 0.0
    sensors = Sensors(position_noise=QUIET * stroke)
    found = fit([experiment(simulate(values, Excitation.parse("sine:8,step:4"), sensors, stroke=stroke, seed=2)[0])])
    known = uncertainty_of(found)
    assert known.status["lugre.sigma2"] == "at_bound"
    assert found.values["lugre.sigma2"] < 0.1
    assert found.values["lugre.fc"] == pytest.approx(values["lugre.fc"], rel=1e-3)
    assert np.isfinite(known.std["lugre.sigma2"])


def test_given_parameters_have_no_uncertainty_and_are_no_unknowns():
    truth = random_valve(2)[0]
    held = {name: truth[name] for name in ("mass.m", "lugre.sigma2")}
    found = identify([recorded(2)], given=held, check=False)
    for name, value in held.items():
        assert name not in found.uncertainty.names
        assert found.model.parameters[name].value == value
        assert found.model.parameters[name].status == "given"
        assert found.model.parameters[name].std is None
    assert {p.status for p in found.model.parameters.values()} <= STATUSES


@pytest.mark.slow
def test_what_the_model_lacks_widens_the_standard_deviations():
    """A slow disturbance of twenty times the noise: the classic covariance would be ten times too sure of itself."""
    seed = 3
    plain, (truth, stroke) = recorded(seed), random_valve(seed)
    wave = 20 * QUIET * stroke * np.sin(2 * np.pi * 0.37 * plain.time)
    found = fit([experiment(changed(plain, position=plain["position"].values + wave))])
    known = uncertainty_of(found)
    assert found.rms > 5
    assert known.inflation > 3
    z = scores(found, known, truth)
    sure = [name for name in ("mass.m", "spring.K", "spring.F0", "lugre.fc", "lugre.sigma2") if abs(z[name]) < 3]
    assert len(sure) == 5
    assert max(abs(z[name]) * known.inflation for name in sure) > 4


@pytest.mark.slow
def test_more_data_narrows_as_its_square_root():
    once = "mixed:20"
    (_, one, short), (_, four, long) = fitted(2, once), fitted(2, ",".join([once] * 4))
    assert (one.rms, four.rms) == pytest.approx((1.0, 1.0), abs=0.05)  # both leave the noise, and nothing else
    ratio = [short.std[name] / long.std[name] for name in ("spring.K", "spring.F0", "lugre.fc")]
    assert np.median(ratio) == pytest.approx(2.0, rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "least", "most"), [(50.0, 1.45, 2.0), (200.0, 0.95, 1.4)])
def test_noise_counts_more_where_samples_do_not_show_a_slip(rate, least, most):
    _, experiments = stiff_recordings(12118, rate)
    found = fit(experiments)
    known = uncertainty_of(replace(found, systematic=None))
    noise = np.sqrt(np.diag(found.estimate.covariance)) * found.coordinates.slope(found.p)
    mass = known.names.index("mass.m")
    untold = 0.3 * found.values["mass.m"] * (rate == 50.0) / noise[mass]  # no slip shows the mass there
    counted = np.array([known.spread[name] for name in known.names]) / noise
    ratios = np.sqrt(counted**2 - (untold * known.correlation[:, mass]) ** 2)
    assert least < min(ratios) < most
