"""The plant of the demo has an integrator of its own, and is the valve that is served otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.cli.demo.plant import RungeKutta
from recordings import BadInput
from simulator.damadics import COLUMN, INPUTS, Actuator, Parameters

QUICK = Parameters.with_changes({"conductance": 2e-5, "gain": 10.0, "spring_rate": 1.2e5})
COIL = {"position_periodic_force": {"a": 35.0, "b": 0.0, "pitch": 0.006}}


@pytest.mark.slow
def test_it_moves_as_the_actuator_does_by_another_scheme():
    inputs = np.zeros((2400, len(INPUTS)))
    inputs[:, :5] = 0.5, 2.6e6, 2.6e6, 20.0, 300e3
    inputs[1200:, 0] = 0.3
    shown = []
    for kind in (Actuator, RungeKutta):
        valve = kind("lugre", QUICK, COIL)
        state, signals = valve.advance(valve.start(), inputs)
        assert state.step == len(inputs)
        shown.append(signals)
    off = np.abs(shown[0] - shown[1]).max(axis=0)
    assert 0 < off[COLUMN["position"]] < 5e-3
    assert off[COLUMN["pressure"]] < 1e3
    assert (off[[COLUMN[name] for name in ("CV", "P1", "Pz", "F")]] == 0).all()


def test_steps_in_blocks_give_the_same_numbers():
    inputs = np.zeros((400, len(INPUTS)))
    inputs[:, :5] = 0.4, 2.6e6, 2.6e6, 20.0, 300e3
    valve = RungeKutta("lugre", QUICK, COIL)
    whole = valve.advance(valve.start(), inputs)[1]
    state, first = valve.advance(valve.start(), inputs[:150])
    assert np.array_equal(np.vstack([first, valve.advance(state, inputs[150:])[1]]), whole)


def test_other_effects_are_refused():
    with pytest.raises(BadInput, match="it has no backlash"):
        RungeKutta("lugre", QUICK, {"backlash": {"width": 1e-4}}).start()
