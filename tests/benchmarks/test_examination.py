"""The examination: its plant is accurate, its cases are those of a seed, its score lists misses and is sealed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.examination import draws
from benchmarks.examination.plant import CONTROL_S, HELD, run
from benchmarks.examination.score import append, broken, scores, section

SEED = 5
HOUSE = Path(__file__).parents[2]


def rng() -> np.random.Generator:
    return np.random.default_rng(SEED)


def test_the_closed_loop_is_that_of_an_adaptive_integrator():
    q = draws.valve(rng())
    setpoint = q.stroke * np.repeat([0.5, 0.7, 0.45], 20)
    p = (q.K * setpoint[0] + q.F0) / q.area
    state, total, stem = np.array([setpoint[0], 0.0, 0.0, p]), p, []
    for wanted in setpoint:
        stem.append(state[0])
        total += q.integral * (wanted - state[0]) * CONTROL_S
        demand = total + q.gain * (wanted - state[0])

        def rates(_, s, demand=demand):
            x, v, z, p = s
            g = q.fc + (q.fs - q.fc) * np.exp(-((v / q.vs) ** 2))
            dz = v - q.sigma0 * abs(v) * z / g
            force = q.area * p - q.K * x - q.F0 - q.sigma0 * z - q.sigma1 * dz - q.sigma2 * v
            return [v, force / q.m, dz, (demand - p) / q.filling]

        state = solve_ivp(rates, (0.0, CONTROL_S), state, "LSODA", rtol=1e-8, atol=1e-12).y[:, -1]
    mine = run(q, setpoint, rng())[::HELD, 2]
    assert np.ptp(stem) > 0.1 * q.stroke
    np.testing.assert_allclose(mine, stem, atol=1e-4 * q.stroke)


def test_a_seed_makes_the_same_case_again_and_another_seed_another_one():
    def case(seed: int):
        draw = np.random.default_rng(seed)
        valve = draws.valve(draw)
        course = draws.setpoint(valve.stroke, 3.0, "steps", draw)
        return valve, draws.measured(valve, run(valve, course, draw), 100.0, draw)

    (first, recorded), (again, repeated), (other, _) = case(1), case(1), case(2)
    assert first == again
    assert first != other
    np.testing.assert_array_equal(recorded["position"].values, repeated["position"].values)
    np.testing.assert_array_equal(recorded.time, repeated.time)


def test_the_clock_jitters_in_ticks_and_the_channels_have_steps():
    valve = draws.valve(rng())
    recorded = draws.measured(valve, run(valve, np.full(400, 0.5 * valve.stroke), rng()), 100.0, rng())
    ticks = recorded.time / draws.TICK_S
    np.testing.assert_allclose(ticks, np.round(ticks), atol=1e-6)
    assert np.ptp(np.diff(recorded.time)) > 1e-3
    steps = recorded["position"].values / (valve.stroke / 2**14)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


ROWS = [
    {"subject": "trace", "case": 0, "asked": "backlash", "answered": "backlash", "score": "right", "complete": True},
    {"subject": "trace", "case": 1, "asked": "none", "answered": "backlash", "score": "wrong", "complete": True},
    {"subject": "assess", "case": 0, "failed": "refused: too short"},
    {"subject": "monitor", "case": 0, "asked": "friction +40 %", "false_alarms": 2, "promised": 0.5, "standing": True,
     "delay_s": None},
]  # fmt: skip


def test_the_score_counts_and_lists_every_miss():
    lines = list(scores(ROWS))
    assert "| trace | 2 | 1 right, 1 wrong |" in lines
    missed = [line for line in lines if line.startswith("- ")]
    assert [line.split(":")[0] for line in missed] == ["- trace 1 (none)", "- assess 0", "- monitor 0 (friction +40 %)"]
    assert "2 false alarms, not seen" in missed[2]


def test_a_section_is_written_once_and_an_edit_is_seen(tmp_path):
    page = tmp_path / "examinations.md"
    page.write_text("# Examinations\n", encoding="utf-8")
    text = section("1.0, seed 3", scores(ROWS))
    append(text, page)
    append(section("1.1, seed 4", ["better"]), page)
    assert broken(page.read_text(encoding="utf-8")) == []
    with pytest.raises(ValueError, match="written once"):
        append(text, page)
    assert broken(page.read_text(encoding="utf-8").replace("1 wrong", "0 wrong")) == ["1.0, seed 3"]


def test_no_section_of_the_page_was_edited():
    assert broken((HOUSE / "docs/examinations.md").read_text(encoding="utf-8")) == []
