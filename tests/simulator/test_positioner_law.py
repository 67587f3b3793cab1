"""The sampled PI positioner: its law by itself, and moving a valve."""

from __future__ import annotations

import numpy as np
import pytest

from simulator import BASE, PERIOD, Positioner, kernel, positioned, random_valve


def test_without_an_error_the_force_is_that_of_the_spring():
    values, stroke = random_valve(1)
    held = Positioner.of(values, stroke, 0.5 * stroke)
    rest = values["spring.F0"] + values["spring.K"] * 0.5 * stroke
    assert [held.force(0.5 * stroke, 0.5 * stroke, PERIOD) for _ in range(3)] == [pytest.approx(rest)] * 3


def test_a_lasting_error_integrates_up_to_the_supply():
    values, stroke = random_valve(1)
    law = Positioner.of(values, stroke, 0.5 * stroke)
    forces = [law.force(0.9 * stroke, 0.5 * stroke, PERIOD) for _ in range(1000)]
    assert np.all(np.diff(forces) >= 0)
    assert forces[0] < forces[100] < forces[-1] == law.limits[1]


@pytest.mark.parametrize("rate", [50.0, 200.0])
def test_a_valve_follows_its_demand(rate):
    values, stroke = random_valve(2)
    t = np.arange(0.0, 8.0, 1 / rate)
    demand = np.where(t < 1.0, 0.3, 0.6) * stroke
    valve = kernel(BASE)
    force, position = positioned(
        valve, valve.vector(values), values, t, demand, stroke=stroke, start=0.3 * stroke, h_max=1e-3
    )
    assert np.ptp(position[t < 1.0]) < 1e-3 * stroke
    assert position[-1] == pytest.approx(0.6 * stroke, abs=0.01 * stroke)
    assert np.isfinite(force).all()
