"""The parts of the service alone: supervision, queues, rings, what movements say, and what outlives a restart."""

from __future__ import annotations

import asyncio
import json
import logging
from dataclasses import replace

import numpy as np
import pytest
from service_rig import plan_of, plant_file, until

from detector import Measurement
from hil import BackOff, Health, MonitorEvent
from hil.page.views.events import event_rows
from hil.service.acquisition import ValveLink
from hil.service.health import HealthCause, Lasting, Standing
from hil.service.in_service.movements import KeptMovements, Movements
from hil.service.in_service.travel import Travel
from hil.service.in_service.trend import MOST, FigureValue, trended, with_value
from hil.service.in_service.window import SIGNALS, looked_at
from hil.service.keeping import StateFolder
from hil.service.lane import ValveLane, utc_now
from hil.service.queue import BoundedQueue
from hil.service.recent import NewestEvents, RecentRing
from hil.service.supervision import SupervisedTask
from recordings import BadInput, Plant, SignalSpec

QUICK = BackOff(0.01, 0.02)


def test_a_failing_task_is_reported_and_begun_anew_and_its_neighbour_does_not_notice(caplog):
    caplog.set_level(logging.WARNING, "bristle.monitor")

    async def story() -> None:
        began, beats = [], []

        async def failing() -> None:
            began.append(len(beats))
            raise OSError(28, "No space left on device")

        async def steady() -> None:
            while True:
                beats.append(1)
                await asyncio.sleep(0.001)

        bad, good = SupervisedTask("disk", failing, again=QUICK), SupervisedTask("reading", steady)
        work = [asyncio.create_task(task.run()) for task in (bad, good)]
        await until(lambda: len(began) >= 4, "four beginnings")
        assert good.status.running
        assert (good.status.restarts, bad.status.restarts >= 3) == (0, True)
        assert began == sorted(set(began)), "the neighbour went on between the beginnings"
        assert "No space left" in bad.status.last_error
        for task in work:
            task.cancel()
        await asyncio.gather(*work, return_exceptions=True)
        assert not good.status.running

    asyncio.run(story())
    assert "task 'disk' failed: OSError" in caplog.text


def test_a_task_that_fails_for_long_is_logged_when_it_begins_and_when_it_is_over(caplog):
    caplog.set_level(logging.WARNING, "bristle.monitor")

    async def story() -> None:
        began = []

        async def failing_ten_times() -> None:
            began.append(1)
            if len(began) <= 10:
                raise OSError(28, "No space left on device")
            await asyncio.Event().wait()

        work = asyncio.create_task(SupervisedTask("disk", failing_ten_times, again=QUICK, steady_s=0.1).run())
        await until(lambda: "runs again" in caplog.text, "it has recovered")
        work.cancel()
        await asyncio.gather(work, return_exceptions=True)

    asyncio.run(story())
    failed, over = [record.getMessage() for record in caplog.records]
    assert failed.startswith("task 'disk' failed: OSError")
    assert over == "task 'disk' runs again; it had failed 10 times"


def test_a_task_that_returns_is_done():
    async def nothing() -> None:
        pass

    task = SupervisedTask("once", nothing)
    asyncio.run(task.run())
    assert task.ended
    assert task.status.restarts == 0


def test_a_full_queue_drops_the_oldest_counts_it_and_never_waits():
    queue = BoundedQueue[int](3)
    for k in range(10):
        queue.put(k)
    assert (queue.dropped, len(queue), queue.full) == (7, 3, True)
    assert queue.take(2) == [7, 8]
    assert queue.take() == [9]
    assert queue.take() == []


def test_the_ring_of_recent_samples_is_in_order_and_has_only_what_is_measured():
    ring = RecentRing(True, False, kept=5)
    assert len(ring.samples().time_s) == 0
    for k in range(13):
        ring.add(float(k), 0.1 * k, 0.2 * k, 9.0, np.nan, np.nan)
    found = ring.samples()
    assert found.time_s.tolist() == [8.0, 9.0, 10.0, 11.0, 12.0]
    assert found.setpoint_m is not None
    assert found.force_N is None


def test_travel_counts_time_movements_and_reversals():
    travel = Travel()
    for k, position in enumerate([20.0, 30.0, 40.0, 30.0, 20.0, 20.1, 20.0, 60.0, 59.0]):
        travel.add(float(k), position)
    assert travel.reversals == 3
    assert travel.whole == pytest.approx(20.0 + 20.0 + 40.0)
    places, lengths = travel.histograms
    assert sum(places.counts) == travel.observed_s == 8.0
    assert dict(zip(lengths.edges, lengths.counts, strict=False))[20.0] == 3.0
    travel.add(1e6, 50.0)  # a silence of days is not time at a position
    assert travel.observed_s == 8.0


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_a_trend_covers_its_truth_and_old_values_are_thinned(seed):
    random, history = np.random.default_rng(seed), ()
    for day in range(MOST + 50):
        value = 130.0 + 0.05 * day + random.normal(0.0, 3.0)
        history = with_value(history, FigureValue(86400.0 * day, value, value - 6.0, value + 6.0))
    assert len(history) <= MOST
    found = trended(history, "N")
    assert found.per_day.lower < 0.05 < found.per_day.upper
    assert found.per_day.upper - found.per_day.lower < 0.05
    assert trended(history[:3], "N").per_day is None
    assert trended((), "N") is None


def swept(seed: int, friction: float = 120.0, spring: float = 1.1e5, stroke: float = 0.04) -> np.ndarray:
    """A stem that follows a slow triangle: rows of a window, with pressure over 0.03 m2."""
    random, t = np.random.default_rng(seed), np.arange(0.0, 400.0, 0.1)
    phase = t / 50.0 % 2.0
    x = stroke * (0.25 + 0.5 * np.minimum(phase, 2.0 - phase))
    force = 500.0 + spring * x + friction * np.where(phase < 1.0, 1.0, -1.0)
    rows = np.full((len(t), 1 + len(SIGNALS)), np.nan)
    rows[:, 0], rows[:, 1] = t, x + random.normal(0.0, 2e-6, len(t))
    rows[:, 2], rows[:, 4] = x / stroke, force / 0.03 + random.normal(0.0, 10.0, len(t))
    return rows


@pytest.mark.parametrize("seed", [21, 22, 23])
def test_natural_movement_tells_friction_and_spring_rate(seed):
    found = looked_at(swept(seed), ("position", "setpoint", "pressure"), Plant(stroke_m=0.04, diaphragm_area_m2=0.03))
    assert found.values["friction"].value == pytest.approx(120.0, rel=0.03)
    assert found.values["spring_rate"].value == pytest.approx(1.1e5, rel=0.03)
    assert found.friction_unit == "N"
    assert found.curve is not None
    assert "dead_band" not in found.values, "an input that is never held shows its lag, too"
    assert any("lag" in note for note in found.notes)


def test_steps_tell_dead_time_t86_and_overshoot():
    t = np.arange(0.0, 200.0, 0.1)
    asked = 0.4 + 0.1 * (t // 20.0 % 2.0)
    x, tau, lag = np.empty_like(t), 1.5, 5
    x[0] = asked[0]
    for k in range(1, len(t)):
        x[k] = x[k - 1] + 0.1 / tau * (asked[max(k - lag, 0)] - x[k - 1])
    rows = np.full((len(t), 1 + len(SIGNALS)), np.nan)
    noise = np.random.default_rng(31).normal(0.0, 2e-6, len(t))
    rows[:, 0], rows[:, 1], rows[:, 2] = t, 0.04 * x + noise, asked
    found = looked_at(rows, ("position", "setpoint"), Plant(stroke_m=0.04))
    assert found.steps >= 8
    assert found.values["dead_time"].value == pytest.approx(0.5, abs=0.15)
    assert found.values["t86"].value == pytest.approx(0.5 + 2.0 * tau, abs=0.25)
    assert found.values["overshoot"].value < 1.0


class Known:
    """A valve as its movements are asked about."""

    signals = (SignalSpec("position", "m", "output"), SignalSpec("setpoint", "1", "input"))

    def known(self, name: str) -> float | None:
        return {"stroke_m": 0.04}.get(name)


def test_movements_outlive_a_restart_and_a_hostile_file_is_refused():
    moved = Movements(Known())
    for k in range(300):
        moved.add(Measurement(0.1 * k, {"position": 0.02 + 0.01 * np.sin(k / 10.0), "setpoint": 0.5}))
    figures = moved.figures(moved.window(), at=1.7e9)
    assert figures.reversals > 5
    again = Movements(Known())
    again.resume(KeptMovements.model_validate_json(moved.kept().model_dump_json()))
    assert again.figures(again.window(), at=1.7e9).travel == figures.travel
    good = json.loads(moved.kept().model_dump_json())
    for wrong in ({"places_s": [1.0]}, {"observed_s": "1e999"}, {"reversals": -1}, {"other": 1},
                  {"history": {"friction": [[0, 0, 0, 0]] * (MOST + 1)}}):  # fmt: skip
        with pytest.raises(ValueError, match="validation error"):
            KeptMovements.model_validate({**good, **wrong})


@pytest.fixture
def lane(tmp_path) -> ValveLane:
    plan = plan_of(plant_file(tmp_path, 1)).valves[0]
    queue = BoundedQueue(10)
    return ValveLane(plan, ValveLink("V1", "tcp://rig", 10.0, [queue]), queue, lambda event: None)


def test_how_a_valve_stood_is_kept_over_a_restart(tmp_path, lane):
    folder, since = StateFolder(tmp_path / "state"), utc_now()
    changed = HealthCause("alarm friction", Health.MAINTENANCE, "the friction has changed")
    lane.standing = replace(lane.standing, valve=Lasting(changed, since))
    folder.save(lane)
    lane.standing = Standing.first()
    folder.resume(lane)
    assert lane.standing.valve == Lasting(changed, since)
    assert lane.standing.worst.cause.health is Health.CHECK, "nothing came yet"
    assert not list((tmp_path / "state").glob("*.part"))


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"\xff\xfe", b"[" * 100_000, b'{"format": "monitor-service", "version": 9}', b"null", b" " * 5_000_000],
)
def test_a_state_that_cannot_be_used_is_set_aside_with_a_message(content, tmp_path, lane, caplog):
    caplog.set_level(logging.WARNING, "bristle.monitor")
    folder = StateFolder(tmp_path / "state")
    folder.service_file("V1").write_bytes(content)
    folder.detector_file("V1").write_bytes(content)
    assert folder.resume(lane) is False
    kept = sorted(path.name for path in folder.folder.iterdir())
    assert len(kept) == 2
    assert all(name.endswith(".unusable") for name in kept)
    assert caplog.text.count("it is set aside as") == 2
    folder.save(lane)


def test_a_state_folder_that_cannot_be_written_is_refused_at_once(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="nothing can be written there"):
        StateFolder(tmp_path / "file" / "state")


def test_a_bad_link_does_not_push_an_alarm_out_of_sight_and_its_troubles_share_a_row():
    newest = NewestEvents(kept=5)
    newest.add(MonitorEvent(0.5, 0.5, "V", "alarm", "the friction has changed", "friction"))
    newest.add(MonitorEvent(0.7, 0.7, "V", "alarm", "now named", "friction"))
    for k in range(1, 40):
        newest.add(MonitorEvent(float(k), float(k), "V", "deadline_missed", f"trouble {k}"))
    newest.add(MonitorEvent(40.0, 40.0, "V", "cleared", "nothing above its limit"))
    assert [one.t_s for one in newest.all] == [0.5, 0.7, 35.0, 36.0, 37.0, 38.0, 39.0, 40.0]
    rows = event_rows(newest.all)
    assert [(row.kind, row.times) for row in rows] == [
        ("cleared", 1), ("deadline_missed", 5), ("alarm", 1), ("alarm", 1),
    ]  # fmt: skip
    assert (rows[1].text, rows[1].wall) == ("trouble 39", 39.0)
