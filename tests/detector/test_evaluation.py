"""Indices, levels, alarms, structure, diagnosis and the learned relations behind the evaluation."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.measured_data import PLANT_HOUR
from detector.evaluation import (
    BENCHMARK,
    DETECTORS,
    BenchmarkRun,
    Plan,
    Setting,
    Zone,
    alarms,
    calibrate,
    chance,
    count_alarms,
    evaluate,
    examples,
    feature_vectors,
    healthy,
    indices,
    largest,
    learn_diagnosis,
    learn_symptoms,
    misisolation,
    plant_hour,
    random_start,
    simulate,
    structural_groups,
    structural_signatures,
    with_fault,
)
from detector.generators import learn_servo
from recordings import BadInput
from simulator.damadics import run_scenario

ZONE = Zone(300, 900, 1500)


def decision(*pieces):
    said = np.zeros(1500, bool)
    for first, last in pieces:
        said[first:last] = True
    return said


def test_indices_of_a_clean_detection():
    found = indices(decision((910, 1500)), ZONE)
    assert (found.first, found.tdt, found.rfd, found.fsd) == (10.0, 10.0, 0.0, 1.0)
    assert found.rtd == pytest.approx(590 / 600)


def test_last_rising_edge_punishes_chatter_and_false_detections_count():
    found = indices(decision((400, 460), (910, 920), (1200, 1210)), ZONE)
    assert (found.first, found.tdt) == (10.0, 300.0)
    assert found.rfd == pytest.approx(0.1)
    assert found.rtd == pytest.approx(20 / 600)


def test_an_alarm_that_stands_from_before_is_no_detection():
    found = indices(decision((800, 1500)), ZONE)
    assert not found.detected
    assert found.tdt is None
    assert found.rtd == 1.0


def test_strength_at_detection_of_a_growing_fault():
    slow = Zone(300, 900, 2400, tfd=900.0, fsmax=0.8)
    said = np.zeros(2400, bool)
    said[900 + 450 :] = True
    assert indices(said, slow).fsd == pytest.approx(0.4)


def test_misisolation_counts_wrong_groups_over_the_judged_time():
    flagged = np.zeros(1500, np.int64)
    flagged[900:1500] = 2
    assert misisolation(flagged, ZONE) == pytest.approx(1.0)


def test_chance_of_a_random_alarm():
    assert chance(0, 5, 0.1) == pytest.approx(1.0)
    assert chance(5, 5, 0.1) == pytest.approx(1e-5)


@pytest.mark.parametrize("rate", [0.02, 0.1, 0.5])
def test_levels_keep_the_stated_rate_on_fresh_data(rate):
    """Gaussian and one-sided channels, 200 h to calibrate, 400 h to judge; counts within a factor of two and chance."""
    rng = np.random.default_rng(1)

    def channels(hours):
        white = rng.normal(size=(hours * 3600, 3))
        white[:, 2] = rng.exponential(size=len(white))
        return white

    levels = calibrate(largest(channels(200), 0), rate)
    found = int(np.sum(levels.statistic(channels(400)) > 1))
    assert found <= 2 * rate * 400 + 3 * np.sqrt(rate * 400) + 1


def test_levels_hold_after_starts_however_rare_they_are():
    """A start leaves a trace that no long run shows: 24 of them set the level, and 200 others keep below it."""
    rng = np.random.default_rng(2)
    long, after = rng.gumbel(3.0, 0.2, (300, 2)), lambda count: rng.gumbel(6.0, 0.1, (count, 2))
    without, levels = calibrate(long, 0.05), calibrate(long, 0.05, starts=[after(24)])
    tried = after(200)
    assert (without.statistic(tried) > 1).mean() > 0.9
    assert (levels.statistic(tried) > 1).sum() <= 5  # 200 blocks of 10 minutes at 0.05 an hour: 1.7 expected
    assert (levels.statistic(long) > 1).sum() == 0


def test_levels_ask_for_enough_blocks():
    with pytest.raises(BadInput, match="blocks"):
        calibrate(np.ones((3, 1)), 0.1)


def test_alarms_hold_and_a_missing_value_is_no_alarm():
    assert alarms(np.array([2.0, 0, 0, 0]), hold_s=1).tolist() == [True, True, False, False]
    levels = calibrate(np.random.default_rng(0).exponential(size=(50, 1)), 0.1)
    assert levels.statistic(np.array([[np.nan]])).tolist() == [0.0]


def test_structure_tells_apart_what_the_relations_say():
    signature, groups = structural_signatures(), structural_groups()
    assert sorted(fault for group in groups for fault in group) == list(range(1, 20))
    assert not any(signature[14])
    assert (17,) in groups
    assert {2, 3, 7, 13} in [set(group) for group in groups]
    assert signature[18] == signature[19] != signature[11]


def test_a_run_is_the_recorded_scenario():
    recording, _ = run_scenario("healthy", noise=True, seed=3, duration=200.0)
    run = healthy(200, Setting(seed=3))[1]
    assert run[:, 4] == pytest.approx(recording["position"].values[:200] / 0.0381, abs=1e-9)
    assert run[:, 5] == pytest.approx(recording["mass_flow"].values[:200] / 40.0, abs=1e-9)


def test_faster_sampling_averages_the_noise_away():
    rows = healthy(300, Setting(seed=4), rates=(1, 10, 100, 400))
    spread = {rate: float(np.std(rows[rate][:, 3])) for rate in rows}  # the temperature is constant: noise alone
    assert spread[1] == pytest.approx(1.414e-3, rel=0.15)
    assert spread[1] > 2 * spread[10] > 4 * spread[100] > 4 * spread[400] > 0


def test_a_run_may_start_elsewhere():
    usual, other = Setting(seed=7), random_start("play", 7)
    assert (other.form, other.seed) == (usual.form, usual.seed)
    assert 0 <= other.position <= 1
    here, there = healthy(200, usual)[1], healthy(200, other)[1]
    assert here[0, 4] == pytest.approx(0.0, abs=0.01)
    assert there[0, 4] == pytest.approx(other.position, abs=0.01)
    assert there[:, 0] == pytest.approx(0.5 + 0.25 * np.sin(0.02 * np.pi * (other.begins_s + np.arange(200))), abs=1e-9)


def test_examples_cover_the_strengths_at_which_a_fault_is_judged():
    made = examples(4)
    assert len({one.seed for one in made}) == len(made)
    assert {one.number for one in made} == set(range(1, 20)) - {14}
    small = sorted(one.strength for one in made if one.number == 1 and one.strength < 0.35)
    assert len(small) == 4
    assert 0.19 <= small[0] < 0.25 < small[-1] <= 0.31
    slow = [one for one in made if one.number == 3]
    assert min(one.strength for one in slow) < 0.1
    assert max(one.grows_s for one in slow) > 43_200
    assert all(one.duration_s < 9000 for one in slow)


def test_a_rate_that_is_not_offered_is_refused():
    with pytest.raises(BadInput, match="at 7 Hz"):
        simulate((), 100, Setting(), rates=(7,))


@pytest.fixture(scope="module")
def learned():
    """Symptoms learned on two hours of seed 11, and the levels of two other hours."""
    runs = [healthy(7200, Setting(seed=seed))[1] for seed in (11, 12, 13)]
    symptoms = learn_symptoms(runs[:2])
    return symptoms, calibrate(largest(symptoms.of(runs[2]), 300, 300), 0.1, 300)


def test_the_servo_learns_its_constants_from_the_name_plate(learned):
    found = dict(zip(("gain", "dead", "fill", "vent", "spring", "preload"), learned[0].servo.constants, strict=False))
    assert learned[0].servo.noise < 3.5e-3
    assert found["spring"] == pytest.approx(80e3, rel=0.1)
    assert found["preload"] == pytest.approx(20e3, rel=0.1)
    assert found["vent"] == pytest.approx(0.55, rel=0.15)


def test_the_servo_steps_as_it_runs(learned):
    servo, run = learned[0].servo, healthy(200, Setting(seed=14))[1]
    u, y = np.column_stack([run[:, 0], 4e6 * (run[:, 1] - run[:, 2])]), run[:, [4]]
    whole = servo.run(servo.initial(), u, y)[1]
    state, rows = servo.initial(), []
    for one, other in zip(u, y, strict=True):
        state, row = servo.step(state, one, other)
        rows.append(row)
    assert np.array(rows) == pytest.approx(whole, abs=1e-12)


def test_the_servo_asks_for_enough_data():
    with pytest.raises(BadInput, match="finite readings"):
        learn_servo(np.zeros((10, 2)), np.zeros(10))


def test_symptoms_of_a_run_do_not_depend_on_what_comes_after(learned):
    run = with_fault(17, 0.75, Setting(seed=15), onset_s=400, grows_s=0, duration_s=700)[1]
    whole, cut = learned[0].of(run), learned[0].of(run[:500])
    assert whole[:500] == pytest.approx(cut, abs=1e-9)


@pytest.mark.parametrize(("number", "strength"), [(1, 0.5), (10, 0.5), (12, 0.75), (13, 0.25), (17, 0.75), (18, 0.25)])
def test_faults_are_seen_and_fault_free_parts_are_not(learned, number, strength):
    symptoms, levels = learned
    run = with_fault(number, strength, Setting(seed=20 + number), onset_s=600, grows_s=0, duration_s=1000)[1]
    statistic = levels.statistic(symptoms.of(run))
    assert statistic[300:600].max() < 1.0 < statistic[600:].max()


@pytest.mark.slow
def test_recursive_estimation_keeps_its_rate_after_starts(learned):
    """Levels from a long run and 24 starts of two kinds; other starts of both kinds, an hour of them, stay below."""

    def starts(first, count):
        for seed in range(first, first + count):
            run = healthy(900, random_start("play", seed) if seed % 2 else Setting(seed=seed))[1]
            yield channels(BenchmarkRun(run, learned[0]))

    runs = [healthy(7200, Setting(seed=seed))[1] for seed in (11, 12)]
    channels = DETECTORS["estimation"].learn(BenchmarkRun(runs[0], learned[0]))
    blocks = [largest(one, 300, 300) for one in (channels(BenchmarkRun(runs[1], learned[0])), *starts(20, 24))]
    levels = calibrate(blocks[0], 0.05, 300, [np.vstack(blocks[1 + kind :: 2]) for kind in (0, 1)])
    assert all(levels.statistic(one)[300:].max() < 1 for one in starts(50, 6))


def test_portraits_tell_how_far_off_a_rod_is_that_saturates_every_symptom(learned):
    """Clogged at a quarter of the stroke, and pushed open by steam: both far beyond what a symptom counts."""
    known = {}
    for number in (1, 7):
        run = with_fault(number, 0.75, Setting(seed=40 + number), onset_s=600, grows_s=0, duration_s=1000)[1]
        alarm = np.arange(len(run)) >= 602
        at, rows = feature_vectors(run, learned[0].of(run), alarm)
        assert at.tolist() == list(range(632, 1000, 30))
        known[number] = rows[-1]
    assert len(known[1]) == len(known[7])
    assert np.abs(known[1] - known[7]).max() > 2


def test_a_sensor_outside_the_basic_signals_leaves_no_trace(learned):
    run = with_fault(14, 0.75, Setting(seed=30), onset_s=600, grows_s=0, duration_s=1000)[1]
    assert np.array_equal(run, healthy(1000, Setting(seed=30))[1])


def test_diagnosis_names_the_fault_or_those_it_cannot_tell_from_it():
    rng = np.random.default_rng(5)
    centres = {1: np.array([5.0, 0, 0]), 2: np.array([0, 5.0, 0]), 3: np.array([0, 5.0, 0.05])}
    made = [(f, f"{f} {i}", c + 0.3 * rng.normal(size=(10, 3))) for f, c in centres.items() for i in range(4)]
    known = learn_diagnosis([*made, (9, "9 that raised no alarm", np.array([]))])
    assert known.members(1) == (1,)
    assert set(known.members(2)) == {2, 3}
    assert known.ranked(np.array([5.0, 0.1, 0]))[0][0] == 1
    assert known.ranked(np.array([0.2, 5.0, 0]))[0][0] in (2, 3)
    assert set(known.matrix()) == {1, 2, 3}
    with pytest.raises(BadInput, match="no example"):
        learn_diagnosis([])


def test_plans_refuse_what_they_do_not_know(tmp_path):
    assert len(BENCHMARK) == 44
    with pytest.raises(BadInput, match="detectors oracle"):
        evaluate(Plan(detectors=("oracle",)), tmp_path)
    assert not list(tmp_path.iterdir())
    with pytest.raises(BadInput, match="scenarios f99"):
        Plan(scenarios=("f99",))
    with pytest.raises(BadInput, match="near to it are f18-abrupt-big"):
        Plan(scenarios=("f18-abrubt-big",))
    with pytest.raises(BadInput, match="variants play-3"):
        Plan(variants=("play-3",))
    assert Plan().key != Plan(rate_per_h=0.1).key
    assert Plan().key == Plan(seeds=9).key


def test_every_detector_says_what_it_is():
    assert {"random", "published", "bank"} <= set(DETECTORS)
    assert all(one.text for one in DETECTORS.values())


@pytest.mark.slow
@pytest.mark.skipif(not PLANT_HOUR.exists(), reason=f"the measured hour of the plant is not there: {PLANT_HOUR}")
def test_the_plant_hour_raises_few_alarms():
    run = plant_hour(PLANT_HOUR)
    assert run.shape == (3600, 6)
    counts = count_alarms(run, ("limits", "voting", "bank"), 0.01)
    assert all(isinstance(count, int) and count <= 5 for count in counts.values())


def test_a_file_that_is_no_plant_hour_is_refused(tmp_path):
    wrong = tmp_path / "hour.mat"
    wrong.write_bytes(b"no matlab file")
    with pytest.raises(BadInput, match=r"hour\.mat"):
        plant_hour(wrong)
