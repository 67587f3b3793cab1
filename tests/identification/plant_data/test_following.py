"""A valve through the years: quantities of a recording, trends, and intervals that hold on seeded wear."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

import bristle as br
from bristle.cli.app import run
from identification.following import TrendBelief, crossing, seen_in
from recordings import BadInput, BadParameter, NegativeAnswer, Plant, Recording

START = datetime(2025, 1, 1, tzinfo=UTC)


def natural(day: int, friction: float, *, leak: float = 0.0, rate: float = 4e4, seed: int = 0) -> Recording:
    """A slow natural movement that rests on the line of spring and friction, with what was asked and the flow."""
    rng = np.random.default_rng([seed, day])
    t = np.arange(0.0, 120.0, 0.2)
    asked = 10 + 40 * (1 - np.cos(2 * np.pi * t / 40)) * (0.8 + 0.1 * np.sin(2 * np.pi * t / 120)) - 12
    stem, place = np.empty(len(t)), asked[0]
    half = 100 * friction / rate / 0.03 * 0.5
    for k, wanted in enumerate(asked):
        place = float(np.clip(place, wanted - half, wanted + half))
        stem[k] = max(place, 0.0)
    way = np.sign(np.gradient(stem))
    force = 300 + rate * 0.03 * stem / 100 + friction * way + rng.normal(0, 1.0, len(t))
    position = 0.03 * stem / 100 + rng.normal(0, 2e-6, len(t))
    flow = 50 * (stem / 100) + 50 * leak / 100
    return Recording.from_arrays(
        time=t, position=position, force=force, setpoint=asked / 100, flow=flow, units={"setpoint": "1"},
        plant=Plant(stroke_m=0.03), title=f"day {day}",
    )  # fmt: skip


def dated(recording: Recording, day: float) -> Recording:
    return replace(recording, created=START + timedelta(days=day))


@pytest.fixture(scope="module")
def year() -> list[Recording]:
    """Friction rises by 0.2 N a day, the seat begins to leak."""
    return [dated(natural(day, 100 + 0.2 * day, leak=0.01 * day), day) for day in range(0, 300, 30)]


def test_a_recording_says_friction_rate_dead_band_and_leak():
    seen = seen_in(dated(natural(0, 120.0, leak=2.0), 0)).values
    assert seen["fc"].value == pytest.approx(120.0, rel=0.1)
    assert seen["K"].value == pytest.approx(4e4, rel=0.05)
    assert seen["dead_band"].value == pytest.approx(100 * 120 / 4e4 / 0.03, rel=0.15)
    assert seen["leak"].value == pytest.approx(100 * 2.0 / 80, rel=0.3)


def test_friction_of_a_simulated_valve_is_seen():
    recording = br.simulate("sine:20", given={"lugre.fc": 150.0, "lugre.sigma2": 100.0}, rate=50, seed=5)
    found = seen_in(dated(recording, 0))
    assert found.values["fc"].value == pytest.approx(150.0, rel=0.1)
    assert "neither a set point" in found.missing["dead_band"]


def test_a_year_is_followed_to_its_limit(year, tmp_path, capsys):
    found = br.follow(year, limits={"fc": 200.0})
    friction = found.quantities["fc"]
    assert friction.slope[1] <= 0.2 <= friction.slope[2]
    median, lower, upper = friction.crossing_dates
    assert lower <= START + timedelta(days=500) <= upper
    assert lower <= median <= upper
    for recording in year[:4]:
        br.write(tmp_path / f"{recording.title}.h5", recording)
    out, page = tmp_path / "follow.json", tmp_path / "page.html"
    assert run(["follow", str(tmp_path), "--limit", "fc=200", "--out", str(out), "--report", str(page)]) == 0
    assert "fc: the limit 200 N is crossed on" in capsys.readouterr().out
    content = json.loads(out.read_text())
    assert len(content["quantities"]["fc"]["levels"]) == 4
    assert content["quantities"]["fc"]["limit"]["limit"] == 200.0
    assert "<html" in page.read_text()


@pytest.mark.browser
def test_the_page_prints_on_a4_with_nothing_cut(year, browser, tmp_path):
    br.follow(year, limits={"fc": 200.0}).report(tmp_path / "page.html")
    assert browser.lost_on_a4(tmp_path / "page.html") == []


def test_a_limit_that_is_crossed_is_said(year):
    assert br.follow(year, limits={"fc": 120.0}).quantities["fc"].crossing.crossed


def test_a_limit_that_is_far_away_has_a_probability_and_an_earliest_date(year):
    friction = br.follow(year, limits={"fc": 900.0}).quantities["fc"]
    assert friction.crossing_dates[0] is None
    words = friction.words()[1]
    assert f"with a probability of {friction.crossing.probability:.2f}, not before 2035" in words


def test_what_was_seen_in_order_is_seen_at_once():
    """The filter is recursive: what it knows after some recordings is enough for those that follow."""
    days, values = [0.0, 10.0, 25.0, 60.0], [100.0, 103.0, 104.0, 112.0]
    belief = TrendBelief.first(days[0], values[0], 1.0)
    for day, value in zip(days[1:3], values[1:3], strict=True):
        belief = belief.seen(day, value, 1.0)
    kept = TrendBelief(**{name: getattr(belief, name) for name in belief.__dataclass_fields__})
    assert np.array_equal(kept.seen(days[3], values[3], 1.0).mean, belief.seen(days[3], values[3], 1.0).mean)


def test_the_trend_is_that_of_least_squares_where_nothing_wanders():
    days, rng = np.arange(0.0, 400.0, 20.0), np.random.default_rng(4)
    values = 100 + 0.1 * days + rng.normal(0, 1.0, len(days))
    belief = TrendBelief.first(days[0], values[0], 1.0)
    for day, value in zip(days[1:], values[1:], strict=True):
        belief = belief.seen(day, value, 1.0)
    still = (belief.wander == 0) & (belief.scatter == 0)
    slope = np.polyfit(days, values, 1)[0]
    assert belief.mean[still][0, 1] == pytest.approx(slope, rel=1e-3)
    assert crossing(belief, 200.0, 100.0).days[0] == pytest.approx((200 - values[-1]) / slope, rel=0.15)


def test_a_level_that_does_not_move_is_not_said_to_cross():
    belief = TrendBelief.first(0.0, 100.0, 0.5)
    for day in range(10, 400, 10):
        belief = belief.seen(float(day), 100.0 + 0.3 * np.sin(day), 0.5)
    met = crossing(belief, 1000.0, 100.0)
    assert met.days == (None, None, None)
    assert met.probability < 0.05


@pytest.mark.parametrize(
    ("recordings", "limits", "error", "said"),
    [
        (lambda: [natural(0, 100.0)], {}, BadInput, "there is no date"),
        (lambda: [dated(natural(0, 100.0), 1), dated(natural(1, 100.0), 1)], {}, BadInput, "date of another"),
        (lambda: [dated(natural(0, 100.0), 1)], {}, NegativeAnswer, "no quantity shows in two"),
        (lambda: [dated(natural(0, 100.0), 1)], {"fs": 3.0}, BadParameter, "not followed"),
    ],
)
def test_what_cannot_be_followed_is_refused(recordings, limits, error, said):
    with pytest.raises(error, match=said):
        br.follow(recordings(), limits=limits)


def test_a_date_in_the_name_counts(tmp_path):
    for month in (1, 2):
        br.write(tmp_path / f"2026-0{month}-03_valve.h5", natural(month, 100.0))
    found = br.follow(tmp_path)
    assert [level.date.month for level in found.quantities["fc"].levels] == [1, 2]


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(BadInput, match="no recording"):
        br.follow(tmp_path)
