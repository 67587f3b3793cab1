"""Friction models on measured presliding loops: what a map of the velocity cannot say there, a state can."""

from __future__ import annotations

import pytest

from benchmarks.measured_data import DATA

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the measured data is not here ({DATA})")


def test_a_state_explains_presliding_loops_and_a_map_does_not() -> None:
    from identification import FRICTION_RIG, compare_friction
    from studies.friction_models import imported

    recording = imported(DATA / "tribometer_presliding/test_data_2.txt.gz", "tribometer")
    found = compare_friction([recording], models=["coulomb", "lugre"], plant=FRICTION_RIG)
    errors = {row.name: row.held_out_n for row in found.rows}
    assert errors["lugre"] < 0.15 * errors["coulomb"]
    assert errors["coulomb"] > 0.8 * found.before_n[1]


def test_the_signature_is_judged_on_points_that_were_not_fitted() -> None:
    from studies.friction_models import AREA_M2, STROKE_M, signature

    found = signature()
    values = found.best.fit.values
    assert found.best.held_out_n < 0.5 * found.before_n[1]
    assert values["spring.K"][0] == pytest.approx(
        751.0 * AREA_M2 / (STROKE_M / 100), rel=0.05
    )  # published: 0.751 kPa/%
