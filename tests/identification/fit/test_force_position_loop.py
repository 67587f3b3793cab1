"""Spring, preload and level of friction from the loop of force over position, of valves that stick and that slide."""

from __future__ import annotations

import numpy as np
import pytest
from stiff_valves import STIFF, stem_test

from identification import experiment
from identification.data.grid import with_smooth_force
from identification.estimators.output_error.force_position_loop import ForcePositionLoop, force_position_loop

SLIDING = {"mass.m": 2.0, "spring.K": 4e4, "lugre.fc": 150.0, "lugre.fs": 160.0, "lugre.sigma2": 300.0}
"""So little more force at break-away that it hardly slips."""
FASTEST = 4 * 2 * np.pi / 40.0 * 0.4 * 0.04
"""Speed of the demand in the sine: four periods in 40 s over 0.8 of a stroke of 40 mm [m/s]."""
LOOSE = {"lugre.fc": 20.0, "lugre.fs": 28.0}
TIGHT = {"lugre.fc": 260.0, "lugre.fs": 400.0}


def loop_of(values: dict[str, float], stiffness: float | None = None, rate: float = 100.0) -> ForcePositionLoop | None:
    courses = ("staircase:20", "sine:40")
    recordings = stem_test(rate, courses, values=values)
    return force_position_loop(with_smooth_force([experiment(r) for r in recordings]), stiffness)


@pytest.mark.parametrize("rate", [200.0, 50.0])
@pytest.mark.parametrize("values", [{}, SLIDING, LOOSE, TIGHT], ids=["sticks", "slides", "loose", "tight"])
def test_spring_and_preload_are_read_to_two_percent_and_a_level_between_coulomb_and_static(values, rate):
    truth, loop = STIFF | values, loop_of(values, rate=rate)
    assert loop is not None
    assert pytest.approx(truth["spring.K"], rel=0.02) == loop.K
    assert pytest.approx(truth["spring.F0"], rel=0.02) == loop.F0
    viscous = truth["lugre.sigma2"] * FASTEST
    assert truth["lugre.fc"] < loop.level < truth["lugre.fs"] + viscous


def test_the_level_of_a_valve_that_sticks_is_its_break_away_force():
    loop = loop_of({}, rate=200.0)
    assert loop is not None
    assert loop.level == pytest.approx(STIFF["lugre.fs"], rel=0.05)


def test_a_spring_that_is_known_is_kept_and_gives_the_preload():
    loop = loop_of({}, stiffness=STIFF["spring.K"])
    assert loop is not None
    assert STIFF["spring.K"] == loop.K
    assert pytest.approx(STIFF["spring.F0"], rel=0.01) == loop.F0


def test_a_stroke_of_two_places_tells_nothing():
    """Of sixty bins along the stroke only the two at its ends hold enough samples."""
    [whole] = stem_test(100.0, ("sine:40",))
    e = experiment(whole)
    [s] = e.segments
    parts = [s.part(max(i - 15, 0), i + 16) for i in (int(np.argmin(s.motion.x)), int(np.argmax(s.motion.x)))]
    assert force_position_loop([e.with_segments(tuple(parts))]) is None
    assert force_position_loop([e]) is not None
