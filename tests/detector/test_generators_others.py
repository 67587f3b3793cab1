"""The residual generators that need no linear plant."""

from __future__ import annotations

import numpy as np
import pytest

from detector.generators import (
    Estimation,
    FaultTree,
    Fuzzy,
    Limits,
    NeuralObserver,
    Rule,
    Spectrum,
    Voting,
    explain,
    learn_dedicated,
    learn_envelope,
    learn_estimation,
    learn_limits,
    learn_neural,
    learn_spectrum,
    learn_takagi_sugeno,
    learn_waves,
)
from recordings import BadInput


def alone(watch, y):
    return watch.run(watch.initial(), np.zeros((len(y), 0)), np.asarray(y, float))[1]


def test_limits_hold_what_they_were_learned_on_and_nothing_else():
    y = np.random.default_rng(0).normal(size=(500, 2))
    checked = learn_limits(y)
    assert np.abs(alone(checked, y)).max() == pytest.approx(1.0)
    assert (np.abs(alone(checked, y + 100)) > 1).all()
    with pytest.raises(BadInput, match="does not vary"):
        learn_limits(np.ones((5, 1)))


def test_voting_names_the_one_of_three_that_differs_and_none_of_two():
    y = np.zeros((4, 3))
    y[1, 0], y[2, 1], y[3, 2] = 5.0, -5.0, 5.0
    three = Voting((1.0, 1.0, 1.0))
    assert three.suspects(alone(three, y), 3.0).tolist() == [-1, 0, 1, 2]
    two = Voting((1.0, 1.0))
    pair = alone(two, y[:, :2])
    assert np.abs(pair[1]).tolist() == [2.5, 2.5]
    assert two.suspects(pair, 1.0).tolist() == [-1] * 4
    with pytest.raises(BadInput, match="voting needs two"):
        Voting((1.0,))


def test_spectrum_sees_a_tone_only_in_its_band():
    rng, t = np.random.default_rng(1), np.arange(2000)
    quiet = rng.normal(size=(2000, 1))
    watch = learn_spectrum(quiet, length=128, bands=(0.0, 0.1, 0.3, 1.0))
    usual = alone(watch, quiet)[128:]
    loud = alone(watch, quiet + 2.0 * np.sin(0.2 * np.pi * t)[:, None])[128:]  # at 0.2 of half the rate: band two
    assert np.abs(usual.mean(axis=0)).max() < 0.1
    assert loud[:, 1].mean() > usual[:, 1].max()
    assert abs(loud[:, 2].mean() - usual[:, 2].mean()) < 0.1


def test_recursive_estimation_follows_a_parameter_that_changes():
    rng = np.random.default_rng(2)
    u, theta = rng.normal(size=(4000, 2)), np.array([2.0, -1.0])
    y = u @ theta + 0.05 * rng.normal(size=4000)
    watch = learn_estimation(u, y, memory=100.0)
    assert watch.usual == pytest.approx(theta, abs=0.01)
    y[2000:] += 0.5 * u[2000:, 0]
    residuals = watch.run(watch.initial(), u, y[:, None])[1]
    assert np.abs(residuals[:2000]).max() < 8
    assert watch.estimates(residuals)[-1] == pytest.approx([2.5, -1.0], abs=0.05)
    assert residuals[3000:, 0].min() > 20 > np.abs(residuals[3000:, 1]).max()


def test_recursive_estimation_is_least_squares_when_it_forgets_nothing():
    rng = np.random.default_rng(3)
    u = rng.normal(size=(300, 2))
    y = u @ np.array([1.0, 3.0]) + rng.normal(size=300)
    unsure = 1e6 * np.eye(2)
    watch = Estimation(1e12, np.zeros(2), np.ones(2), unsure)
    estimate = watch.run(watch.initial(), u, y[:, None])[1][-1]
    assert estimate == pytest.approx(np.linalg.lstsq(u, y, rcond=None)[0], abs=1e-5)


def test_recursive_estimation_survives_a_day_without_excitation():
    rng = np.random.default_rng(4)
    u = rng.normal(size=(90_000, 2))
    u[1000:80_000] = [1.0, 0.0]
    y = u @ np.array([1.0, 2.0]) + 0.1 * rng.normal(size=90_000)
    watch = learn_estimation(u[:1000], y[:1000], memory=50.0)
    estimates = watch.estimates(watch.run(watch.initial(), u, y[:, None])[1])
    assert np.abs(estimates - [1.0, 2.0]).max() < 1.0


def test_dependent_regressors_are_refused():
    with pytest.raises(BadInput, match="rank 1"):
        learn_estimation(np.ones((100, 2)), np.ones(100), 10.0)


def curved(n=3000, seed=5, bend=0.5):
    rng = np.random.default_rng(seed)
    u, y = rng.uniform(-1, 1, (n, 1)), np.zeros((n, 1))
    for k in range(1, n):
        y[k] = 0.6 * y[k - 1] + np.tanh(2 * u[k]) + bend * y[k - 1] * u[k] + 0.02 * rng.normal()
    return u, y


def test_neural_observer_learns_a_curved_plant_better_than_a_line_does():
    u, y = curved()
    watch = learn_neural(u, y, depth=2)
    fresh = curved(seed=6)
    residuals = watch.run(watch.initial(), *fresh)[1][5:]
    past = np.column_stack([fresh[1][:-1], fresh[0][1:], np.ones(len(u) - 1)])
    line = fresh[1][1:] - past @ np.linalg.lstsq(past, fresh[1][1:], rcond=None)[0]
    assert 0.8 < residuals.std() < 1.6
    assert watch.deviation[0] < 0.5 * line.std()


def test_neural_observer_sees_a_plant_that_changed():
    watch = learn_neural(*curved(), depth=2)
    changed = watch.run(watch.initial(), *curved(seed=7, bend=-0.5))[1][5:]
    assert np.sqrt(np.mean(changed**2)) > 3
    with pytest.raises(BadInput, match="give at least"):
        learn_neural(*curved(n=50))


def test_fuzzy_memberships_are_complete_and_rules_take_the_lowest():
    watch = Fuzzy((1.0, 2.0), {"up": {0: "positive"}, "both": {0: "off", 1: "negative"}})
    r = np.array([[0.0, 0.0], [1.0, -1.0], [-5.0, -5.0]])
    terms = watch.memberships(r)
    assert terms["negative"] + terms["normal"] + terms["positive"] == pytest.approx(np.ones((3, 2)))
    assert alone(watch, r).tolist() == [[0.0, 0.0], [0.5, 0.25], [0.0, 1.0]]
    assert watch.score(alone(watch, r), np.array([0.2, 1.0])).tolist() == pytest.approx([0.0, 0.35, 1.0])
    with pytest.raises(BadInput, match="is about residuals"):
        Fuzzy((1.0,), {"wrong": {3: "off"}})


def test_fault_tree_chains_rules_and_says_why():
    rules = (
        Rule("drive", ("position",), ("process",)),
        Rule("spring", ("drive", "force-")),
        Rule("spring", ("crack",)),
    )
    tree = FaultTree(("position", "process", "force", "crack"), rules, limit=1.0)
    y = [[2, 0, -2, 0], [2, 0, 2, 0], [2, 2, -2, 0], [0, 0, 0, 2]]
    assert tree.conclusions == ("drive", "spring")
    assert alone(tree, y).tolist() == [[1, 1], [1, 0], [0, 0], [0, 1]]
    said = explain(tree, ["position", "force-"])
    assert said == ["IF position AND NOT process THEN drive", "IF drive AND force- THEN spring"]
    with pytest.raises(BadInput, match="'magic' in"):
        FaultTree(("a",), (Rule("b", ("magic",)),))


def test_waves_are_found_and_drawn_between_samples():
    t = np.arange(2000.0)
    rng = np.random.default_rng(8)

    def signal(at):
        return 5.0 + np.sin(2.0 * at) + 0.5 * np.cos(0.6 * at)

    noisy = signal(t) + 0.05 * rng.normal(size=len(t))
    waves = learn_waves(noisy)
    assert sorted(waves.frequencies) == pytest.approx([0.6, 2.0], abs=1e-4)
    fine = waves.run(waves.initial(), noisy)[1][500:]
    parts = fine.shape[1]
    between = t[500:, None] - 1 + (np.arange(parts) + 0.5) / parts
    assert np.std(fine - signal(between)) < 0.05


def test_noise_has_no_waves():
    waves = learn_waves(np.random.default_rng(9).normal(size=1000))
    assert waves.frequencies == ()
    assert waves.run(waves.initial(), np.array([1.0, 2.0]))[1][:, 0].tolist() == [1.0, 2.0]


def everyone():
    rng = np.random.default_rng(10)
    u, y = curved(n=400)
    return {
        "limits": (Limits((-1.0,), (1.0,)), u[:, :0], y),
        "voting": (Voting((1.0, 1.0)), u[:, :0], np.hstack([y, u])),
        "spectrum": (learn_spectrum(y, length=16), u[:, :0], y),
        "estimation": (learn_estimation(np.hstack([u, u**2]), y[:, 0], 50.0), np.hstack([u, u**2]), y),
        "fuzzy": (Fuzzy((1.0,), {"off": {0: "off"}}), u[:, :0], y),
        "neural": (learn_neural(u, y, depth=2, hidden=10), u, y),
        "dedicated": (learn_dedicated(u, np.hstack([y, u]), depth=2, hidden=10), u, np.hstack([y, u])),
        "envelope": (learn_envelope(u[:, 0], y[:, 0]), u, y),
        "takagi-sugeno": (learn_takagi_sugeno(u, y, models=2, depth=1), u, y),
        "tree": (FaultTree(("a",), (Rule("b", ("a",)),)), u[:, :0], 4 * rng.normal(size=(400, 1))),
    }


@pytest.mark.parametrize("name", list(everyone()))
def test_step_by_step_is_all_at_once_and_missing_readings_are_passed_over(name):
    watch, u, y = everyone()[name]
    y = y.copy()
    y[30] = np.nan
    before, start = y.copy(), watch.initial()
    kept = start.copy()
    whole = watch.run(start, u, y)
    state, rows = watch.initial(), []
    for one, other in zip(u, y, strict=True):
        state, row = watch.step(state, one, other)
        rows.append(row)
    assert np.array(rows) == pytest.approx(whole[1], abs=1e-9, nan_ok=True)
    assert np.array_equal(y, before, equal_nan=True)
    assert np.array_equal(start, kept, equal_nan=True)
    assert np.isnan(whole[1][30]).all()
    with pytest.raises(BadInput, match="give rows of"):
        watch.run(watch.initial(), np.zeros((3, 9)), np.zeros((3, 9)))


def test_learned_things_know_their_size():
    u, y = curved(n=400)
    assert isinstance(learn_neural(u, y, hidden=10), NeuralObserver)
    assert isinstance(learn_spectrum(y, length=16), Spectrum)
    assert learn_neural(u, y, hidden=10).width == (1, 1, 1)
