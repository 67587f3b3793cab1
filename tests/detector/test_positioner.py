"""The loop of positioner and actuator: against closed forms, on the benchmark valve, and its bound on deafness."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from watched_valve import TENTH, alarms, moved, recorded, seen

from detector import Measurements, Watch, described, learn
from detector.watch.positioner.fitting import learned_positioner
from detector.watch.positioner.kernel import follow
from detector.watch.positioner.loop import N_ANSWERS, OFFSET, PositionerLoop
from recordings import BadInput
from simulator.damadics import Fault


def loop(**constants: float) -> PositionerLoop:
    """A straight curve from 0 to 1, a gain of 2 / s, nothing else."""
    names = ("gain", "up", "down", "push", "slope", "play", "dead", "late")
    plain = {"gain": 2.0, "up": 10.0, "down": 10.0, "push": 0.0, "slope": 0.0, "play": 0.0, "dead": 0.0, "late": 0.0}
    values = plain | constants
    return PositionerLoop(
        (*(values[name] for name in names), 0.0, 0.5, 1.0), 0.0, 1.0, 0.0, 0.5, 1.0, 1.0, (0.0, 1.0), (-1.0, 1.0),
        1e-3, (1.0,) * N_ANSWERS, 0.01,
    )  # fmt: skip


def position(
    of: PositionerLoop, setpoint: np.ndarray, drop: np.ndarray | float = 0.0, start: float = 0.0
) -> np.ndarray:
    t = of.dt_s * np.arange(len(setpoint))
    rows = np.column_stack([t, setpoint, np.broadcast_to(drop, t.shape), np.full(len(t), start)])
    out = np.empty(len(rows))
    follow(rows, 1.0, of.lowest, of.width, np.array(of.constants), out)
    return out


def test_without_dead_band_play_and_limits_it_is_a_lag():
    t, step = 0.01 * np.arange(400), np.full(400, 0.6)
    assert position(loop(), step) == pytest.approx(0.6 * (1.0 - np.exp(-2.0 * t)), abs=5e-3)


def test_it_is_no_faster_than_its_limits_stops_at_the_dead_band_and_turns_behind_the_play():
    limited = position(loop(gain=20.0, up=0.1, down=0.05, dead=0.02), np.r_[np.full(800, 0.5), np.full(1200, 0.1)])
    assert np.diff(limited).max() == pytest.approx(1e-3)
    assert np.diff(limited).min() == pytest.approx(-5e-4)
    assert limited[799] == pytest.approx(0.48, abs=1e-3)
    assert limited[-1] == pytest.approx(0.12, abs=1e-3)
    wave = 0.5 + 0.2 * np.sin(0.2 * np.pi * 0.01 * np.arange(4000))
    with_play, without = (position(loop(gain=20.0, play=play), wave, start=0.5)[2000:] for play in (0.1, 0.0))
    assert np.ptp(without) == pytest.approx(0.4, abs=0.01)
    assert np.abs(np.diff(with_play)).min() < 1e-6 < np.abs(np.diff(without)).max()


def test_trapped_air_gives_way_to_the_process_pressure_within_the_dead_band_only():
    still, drop = np.full(1000, 0.5), np.r_[np.zeros(300), np.full(700, 0.1)]
    trapped = position(loop(push=-0.2, dead=0.05), still, drop, 0.5)
    assert trapped[-1] == pytest.approx(0.48)
    corrected = position(loop(push=-0.2), still, drop, 0.5)
    assert corrected.min() == pytest.approx(0.48, abs=1e-3)
    assert corrected[-1] == pytest.approx(0.5, abs=1e-3)


@pytest.fixture(scope="module")
def healthy() -> Measurements:
    data = seen(400.0, seed=1)
    return Measurements(data.time_s, {name: data.values[name] for name in ("position", "setpoint")})


@pytest.fixture(scope="module")
def learned(healthy) -> PositionerLoop:
    found = learned_positioner(healthy)
    assert found is not None
    return found[0]


def test_it_follows_a_valve_that_it_was_learned_on_and_needs_its_set_point_only(learned, healthy):
    residuals, _ = learned.run(healthy)
    assert learned.deviation < 0.03
    assert learned.signals == ("setpoint",)
    assert np.isfinite(residuals).mean() > 0.9
    assert np.nanstd(residuals) < 1.5


def test_in_steps_and_through_json_it_gives_the_bits_of_the_whole(learned, healthy):
    again = PositionerLoop.from_dict(json.loads(json.dumps(learned.as_dict())))
    state, found = again.initial(), []
    for i, moment in enumerate(healthy):
        state, one = again.step(state, moment, False)
        state = np.array(json.loads(json.dumps(state.tolist()))) if i % 50 == 0 else state
        found.append(one)
    assert np.array_equal(learned.run(healthy)[0], found, equal_nan=True)


def test_it_says_nothing_at_rest_beyond_the_learned_set_points_and_after_a_gap(learned):
    def stimulus(t: np.ndarray) -> np.ndarray:
        columns = moved(np.where(t > 60.0, np.minimum(t, 80.0), t))
        columns[(t > 30.0) & (t < 40.0), 0] = 0.9
        return columns

    data = Measurements.recorded(recorded(140.0, seed=4, stimulus=stimulus))
    t, said = data.time_s, np.isfinite(learned.run(data)[0])
    assert not said[(t > 30.5) & (t < 39.5)].any()
    assert said[(t > 50.0) & (t < 75.0)].mean() > 0.9
    assert not said[t > 100.0].any()
    late = replace(data, time_s=t + 100.0 * (t > 60.0))
    assert not np.isfinite(learned.run(late)[0])[(t > 60.0) & (t < 60.0 + 30 * TENTH)].any()


def test_it_follows_a_drift_but_never_further_than_its_changes_reach(healthy, learned):
    hours = 4.0
    n = int(hours * 3600.0 / (healthy.time_s[-1] - healthy.time_s[0])) + 1
    times = np.concatenate([healthy.time_s + k * (np.ptp(healthy.time_s) + TENTH) for k in range(n)])
    values = {name: np.tile(column, n) for name, column in healthy.values.items()}
    share = np.linspace(0.0, 1.0, len(times))

    def left(offset: float) -> float:
        drifted = values | {"position": values["position"] + offset * learned.span * share}
        found = learned.run(Measurements(times, drifted))[0][-3000:]
        return float(np.nanmean(found)) * learned.deviation

    small, large = 0.5 * OFFSET, 8.0 * OFFSET
    assert abs(left(small)) < 0.5 * small
    assert left(large) > 3.0 * OFFSET


def test_at_a_start_a_small_difference_is_found_out_at_once_and_a_large_one_is_told(healthy, learned):
    def told(offset: float) -> float:
        values = healthy.values | {"position": healthy.values["position"] + offset * learned.span}
        return float(np.nanmean(learned.run(Measurements(healthy.time_s, values))[0][600:1200])) * learned.deviation

    assert abs(told(0.5 * OFFSET)) < 0.15 * OFFSET
    assert told(8.0 * OFFSET) > 3.0 * OFFSET


@pytest.mark.slow
def test_with_nothing_but_set_point_and_position_the_watch_finds_a_positioner_that_has_changed(healthy):
    watch = learn(healthy)
    assert watch.positioner is not None
    assert "the set point leads the position" in described(watch)
    again = Watch.from_dict(json.loads(json.dumps(watch.as_dict())))
    assert again.positioner == watch.positioner
    found, _ = alarms(again, seen(300.0, Fault(12, 1.0, start_s=150.0), seed=6))
    assert found
    assert found[0].time_s > 150.0
    assert alarms(again, seen(300.0, seed=6))[0] == []


def test_a_set_point_that_does_not_lead_the_position_is_not_used_and_the_page_says_so(healthy):
    random = np.random.default_rng(1)
    other = healthy.values | {
        "setpoint": 0.5 + 0.1 * np.cumsum(random.normal(size=len(healthy))) / len(healthy) ** 0.5,
        "force": healthy.values["setpoint"],
    }
    watch = learn(Measurements(healthy.time_s, other))
    assert watch.positioner is None
    assert "positioner: not used" in described(watch)


def test_saved_constants_of_another_form_are_refused(learned):
    with pytest.raises(BadInput, match="learn anew"):
        PositionerLoop.from_dict(learned.as_dict() | {"constants": [1.0, 2.0]})
