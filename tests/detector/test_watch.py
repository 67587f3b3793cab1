"""The detector to use: learned from fault-free data it finds the benchmark's faults, names them, and stays quiet."""

from __future__ import annotations

import json

import numpy as np
import pytest
from watched_valve import MODEL, TENTH, alarms, moved, recorded, seen

from detector import (
    Measurement,
    Measurements,
    SampleVerdict,
    Watch,
    described,
    learn,
    learn_recordings,
    watch_recording,
)
from recordings import BadInput, Recording
from simulator.damadics import Fault

ONSET = 60.0


@pytest.fixture(scope="module")
def healthy() -> Measurements:
    return seen(400.0, seed=1)


@pytest.fixture(scope="module")
def watch(healthy) -> Watch:
    return learn(healthy, MODEL)


@pytest.mark.slow
def test_it_is_quiet_on_healthy_data_it_was_not_learned_on(watch):
    found, _ = alarms(watch, seen(300.0, seed=5))
    assert found == []
    assert watch.false_alarms.per_month > 1.0


@pytest.mark.parametrize(
    ("fault", "within_s", "kind", "named_s"),
    [
        (Fault(4, 0.3, start_s=ONSET), 15.0, "friction", 40.0),
        (Fault(11, 0.5, start_s=ONSET), 5.0, "spring", 40.0),
        (Fault(13, 0.25, start_s=ONSET), 5.0, "sensor", 20.0),
        (Fault(16, 0.5, start_s=ONSET), 1.0, "supply", 1.0),
        (Fault(17, 0.25, start_s=ONSET), 2.0, "flow", 2.0),
        (Fault(18, 0.5, start_s=ONSET), 15.0, "flow", 15.0),
    ],
    ids=lambda value: f"f{value.number}" if isinstance(value, Fault) else None,
)
def test_a_fault_is_found_and_named_in_time(watch, fault, within_s, kind, named_s):
    found, _ = alarms(watch, seen(ONSET + 50.0, fault, seed=6))
    first = found[0]
    assert first.began
    assert ONSET <= first.time_s <= ONSET + within_s
    named = [said for said in found if said.kind == kind]
    assert named
    assert named[0].time_s <= ONSET + named_s


def test_sensor_and_flow_remain_until_the_stem_has_moved_and_then_one_is_named(watch):
    found, _ = alarms(watch, seen(ONSET + 40.0, Fault(2, 0.75, start_s=ONSET), seed=6))
    assert found[0].began
    assert {said.kind for said in found} <= {None, "flow"}
    assert found[-1].kind == "flow" or found[-1].remaining == ("sensor", "flow")


def test_after_the_fault_is_gone_the_alarm_is_cleared_and_the_next_one_found(watch):
    there_and_gone = Fault(11, 0.5, start_s=60.0, stop_s=90.0)
    again = Fault(11, 0.5, start_s=200.0)
    found, _ = alarms(watch, seen(230.0, there_and_gone, again, seed=7))
    course = ["began" if said.began else "ended" for said in found if said.began or said.ended]
    assert course[:3] == ["began", "ended", "began"]


def test_twenty_four_hours_do_not_make_it_deaf(watch, healthy):
    calibration = watch.calibration
    observer, (t, x, u) = calibration.compiled, calibration.scaled(healthy)
    times = len(t) * TENTH + 5.0  # a gap between the rounds starts the errors anew and leaves the estimates
    rounds, state = int(86400.0 / times) + 1, observer.initial()
    for k in range(rounds):
        state, said = observer.run(state, t + k * times, x, u)
        assert not said.alarm.any()
    assert state.estimates["b1"] <= calibration.b1 + calibration.bounds.b1
    fault = calibration.scaled(seen(90.0, Fault(11, 0.75, start_s=ONSET), seed=8))
    fresh = observer.run(observer.initial(), *fault)[1].first_alarm()
    aged = observer.run(state, fault[0] + 2e5, *fault[1:])[1].first_alarm()
    assert fresh is not None
    assert aged is not None
    assert aged - 2e5 == pytest.approx(fresh, abs=1.0)


@pytest.mark.parametrize("stop", [0.0, 1.0], ids=["open", "closed"])
def test_a_healthy_valve_that_rests_on_a_stop_for_a_while_is_no_alarm(watch, stop):
    def stimulus(t: np.ndarray) -> np.ndarray:
        columns = moved(t)
        columns[(t > 60.0) & (t < 100.0), 0] = stop
        return columns

    data = Measurements.recorded(recorded(160.0, seed=4, stimulus=stimulus))[100:]
    assert np.ptp(data.values["position"]) > 0.45 * 0.0381
    assert alarms(watch, data)[0] == []


@pytest.mark.parametrize(
    "hours", [pytest.param(0.25, marks=pytest.mark.slow), pytest.param(24.0, marks=pytest.mark.long)]
)
def test_hours_without_a_fault_do_not_make_the_whole_detector_deaf(watch, hours):
    found, aged = alarms(watch, seen(3600.0 * hours, seed=9))
    assert found == []
    for fault, within_s in ((Fault(4, 0.3, start_s=ONSET), 2.0), (Fault(11, 0.5, start_s=ONSET), 1.0)):
        data = seen(ONSET + 30.0, fault, seed=6)
        first, again = alarms(watch, data)[0], alarms(watch, data, watch.resumed(aged))[0]
        assert first[0].time_s > ONSET
        assert again[0].time_s == pytest.approx(first[0].time_s, abs=within_s)


def test_replayed_twice_it_decides_the_same_bit_for_bit_also_from_a_saved_state(watch):
    data = seen(80.0, Fault(11, 0.5, start_s=ONSET), seed=6)

    def decided(of: Watch, through_json: bool) -> list[object]:
        state, said = of.initial(), []
        for i, row in enumerate(data):
            state, one = of.step(state, row)
            said.append(one)
            if through_json and i % 97 == 0:
                state = of.state_from_dict(json.loads(json.dumps(state.as_dict())))
        return said

    again = Watch.from_dict(json.loads(json.dumps(watch.as_dict())))
    assert decided(watch, False) == decided(again, True)


def test_gaps_and_missing_values_are_no_alarm(watch, healthy):
    broken = {name: values.copy() for name, values in healthy.values.items()}
    random = np.random.default_rng(2)
    for values in broken.values():
        values[random.random(len(values)) < 0.02] = np.nan
    keep = np.ones(len(healthy), bool)
    keep[500:620] = False
    data = Measurements(healthy.time_s[keep], {name: values[keep] for name, values in broken.items()})
    state, verdicts = watch.initial(), []
    for row in data:
        state, said = watch.step(state, row)
        verdicts.append(said.verdict)
        assert not said.alarm
        assert np.isfinite([said.residual, said.threshold, said.load]).all()
    assert {SampleVerdict.START, SampleVerdict.USED, SampleVerdict.GAP, SampleVerdict.NOT_FINITE} <= set(verdicts)


def test_a_step_changes_no_state_it_was_given(watch, healthy):
    state = watch.initial()
    for row in healthy[:120]:
        state, _ = watch.step(state, row)
    before = json.dumps(state.as_dict())
    watch.step(state, next(iter(healthy[120:121])))
    assert json.dumps(state.as_dict()) == before


def test_without_pressure_or_model_the_observer_works_alone(healthy):
    few = Measurements(healthy.time_s, {name: healthy.values[name] for name in ("position", "setpoint")})
    alone = learn(few, MODEL)
    assert alone.model is None
    assert alone.signals == ("position", "setpoint")
    assert "not used" in described(alone)
    _, said = alone.step(alone.initial(), Measurement(0.0, {"position": 0.02, "setpoint": 0.5}))
    assert said.verdict is SampleVerdict.START


def refused(data: Measurements) -> BadInput:
    with pytest.raises(BadInput) as problem:
        learn(data, MODEL)
    return problem.value


def test_data_that_support_no_rate_are_refused_in_words(healthy):
    assert "too few" in str(refused(healthy[:150]))
    assert "to and fro" in str(refused(healthy[:400]))
    still = {**healthy.values, "position": np.full(len(healthy), 0.019)}
    assert "does not move" in str(refused(Measurements(healthy.time_s, still)))
    alone = Measurements(healthy.time_s, {"position": healthy.values["position"]})
    assert "no input" in str(refused(alone))


def test_saved_parts_that_cannot_be_read_are_refused(watch):
    with pytest.raises(BadInput, match="learn anew"):
        Watch.from_dict({"calibration": {}})
    with pytest.raises(BadInput, match="learn anew"):
        watch.state_from_dict({"model": None})
    parts = watch.initial().as_dict() | {"levels": []}
    with pytest.raises(BadInput, match="another detector"):
        watch.state_from_dict(parts)


def test_a_recording_is_watched_in_one_call_and_nothing_differs_from_step_by_step(watch):
    recording = recorded(80.0, Fault(11, 0.5, start_s=ONSET), seed=6)
    watched, state = watch_recording(watch, recording), watch.initial()
    for moment, judgement in zip(Measurements.recorded(recording), watched.judgements, strict=True):
        state, expected = watch.step(state, moment)
        assert judgement == expected
    assert np.array_equal(watched.time_s, recording.time)
    assert watched.alarm.any()
    assert watched.alarms[0] in watched.changes
    assert (watched.residual[watched.load > 1.0] > watched.threshold[watched.load > 1.0]).all()
    assert repr(watched).endswith("alarm>" if len(watched.alarms) == 1 else "alarms>")
    few = Recording.of([recording["time"], recording["position"]], plant=recording.plant)
    with pytest.raises(BadInput, match="was learned with"):
        watch_recording(watch, few)


def test_a_detector_is_learned_from_several_recordings_with_a_gap_between():
    parts = [recorded(250.0, seed=seed) for seed in (1, 2)]
    joined = Measurements.joined(parts)
    assert len(joined) == sum(len(one.time) for one in parts)
    assert np.diff(joined.time_s).max() == pytest.approx(1000 * TENTH)
    assert learn_recordings(parts).as_dict() == learn(joined).as_dict()
    other = Recording.of([parts[0]["time"], parts[0]["position"]], plant=parts[0].plant)
    with pytest.raises(BadInput, match="same signals"):
        Measurements.joined([parts[0], other])
    with pytest.raises(BadInput, match="give one"):
        Measurements.joined([])
