"""Dead time: as accurate as the sampling lets it be, smooth in its size, and the same in blocks as at once."""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np
import pytest
from lugre_reference import STROKE, Valve, slow_force

from recordings import BadInput
from simulator import BASE, CATALOGUE, Effect, Excitation, Parameter, Sensors, Site, kernel, simulate
from simulator.damadics import COLUMN, Actuator
from simulator.damadics.actuator import past as recall
from simulator.damadics.actuator.parameters import STEP

VALVE = Valve()
REST = (slow_force(0.0) - VALVE.F0) / VALVE.K
PLAIN, LATE = kernel(BASE), kernel((*BASE, "dead_time"))


def late(t, u, tau, start=None, **options):
    p = LATE.vector(VALVE.values() | {"dead_time.tau": tau})
    return LATE.run(t, u, p, LATE.start(REST) if start is None else start, **options)


@pytest.mark.parametrize("rate", [100, 400, 1000])
@pytest.mark.parametrize("tau", [5e-4, 3.3e-3, 0.01, 0.03])
def test_it_adds_nothing_to_the_error_of_sampling(rate, tau):
    fine, t = np.arange(12001) * 1e-4, np.arange(round(1.2 * rate)) / rate
    p, every = PLAIN.vector(VALVE.values()), round(1e4 / rate)
    force = slow_force(fine)

    def error(found, true_force):
        return np.sqrt(np.mean((found - PLAIN.run(fine, true_force, p, PLAIN.start(REST)).outputs[:-1:every, 0]) ** 2))

    ours = error(late(t, slow_force(t), tau, h_max=1e-4).outputs[:, 0], slow_force(np.maximum(fine - tau, 0.0)))
    sampled = error(PLAIN.run(t, slow_force(t), p, PLAIN.start(REST), h_max=1e-4).outputs[:, 0], force)
    assert ours <= 1.3 * sampled + 1e-6 * STROKE
    ignored = error(late(t, slow_force(t), 0.0, h_max=1e-4).outputs[:, 0], slow_force(np.maximum(fine - tau, 0.0)))
    assert ours < 0.2 * ignored or rate == 100


@pytest.mark.parametrize("tau", [0.0, 2e-3, 3.1e-3, 0.02])
@pytest.mark.parametrize("hold", [False, True])
def test_its_derivative_is_that_of_what_it_computes(tau, hold):
    t = np.arange(401) / 500.0
    exact = late(t, slow_force(t), tau, sensitivities=True, hold=hold).jacobian[
        :, 0, LATE.parameters.index("dead_time.tau")
    ]
    h = 1e-7
    seen = (late(t, slow_force(t), tau + h, hold=hold).outputs - late(t, slow_force(t), tau, hold=hold).outputs) / h
    assert np.linalg.norm(exact - seen[:, 0]) < 5e-3 * np.linalg.norm(seen)


def test_a_delay_of_whole_samples_is_a_shift_of_them():
    t = np.arange(401) / 500.0
    u = slow_force(t)
    shifted = np.concatenate([np.full(5, u[0]), u[:-5]])
    for hold in (False, True):
        moved = PLAIN.run(t, shifted, PLAIN.vector(VALVE.values()), PLAIN.start(REST), hold=hold).outputs
        assert late(t, u, 0.01, hold=hold).outputs == pytest.approx(moved, abs=1e-9 * STROKE)


@pytest.mark.parametrize("hold", [False, True])
def test_it_may_take_seconds(hold):
    t = np.arange(3001) / 500.0
    u = slow_force(t)
    shifted = np.concatenate([np.full(1000, u[0]), u[:-1000]])
    moved = PLAIN.run(t, shifted, PLAIN.vector(VALVE.values()), PLAIN.start(REST), hold=hold).outputs
    assert late(t, u, 2.0, hold=hold).outputs == pytest.approx(moved, abs=1e-9 * STROKE)


def test_a_positioner_that_waits_for_seconds_is_simulated_as_a_whole():
    values = VALVE.values() | {"dead_time.tau": 1.5}
    sensors, positioner = Sensors(rate=100.0), Excitation((("positioner", 6.0),))
    effects = (*BASE, "dead_time")
    _, truth = simulate(values, positioner, sensors, stroke=STROKE, effects=effects)
    force, t = truth["force"], np.arange(601) / 100.0
    start = LATE.start(truth["position"][0], force=force[0])
    whole = LATE.run(t, force, LATE.vector(values), start, hold=True, h_max=5e-5).outputs[:, 0]
    assert np.abs(np.diff(force[:140])).max() > 0
    assert truth["position"][:150] == pytest.approx(np.full(150, truth["position"][0]), abs=0.01 * STROKE)
    assert truth["position"] == pytest.approx(whole, abs=1e-9)


def test_blocks_with_their_past_are_the_whole():
    t = np.arange(301) / 500.0
    u, p = slow_force(t), LATE.vector(VALVE.values() | {"dead_time.tau": 0.013})
    rows, state, found = LATE.inputs(t, u, p), LATE.start(REST), []
    for first, last in itertools.pairwise((0, 7, 150, 300)):
        run = LATE.run(t[first : last + 1], rows[first : last + 1], p, state)
        state, found = run.final, [*found, *run.outputs[:-1, 0]]
    assert found == pytest.approx(late(t, u, 0.013).outputs[:-1, 0], abs=1e-15)


def test_what_else_is_known_of_the_force_stays():
    t = np.arange(101) / 500.0
    u, p = slow_force(t), LATE.vector(VALVE.values() | {"dead_time.tau": 0.01})
    rows = LATE.inputs(t, u, p)
    rows[:, 0] += 10.0
    more = late(t, u + 10.0, 0.01)
    assert late(t, rows, 0.01).outputs == pytest.approx(more.outputs, abs=1e-12)


def test_there_is_one_dead_time():
    class Second(Effect):
        """Another delay."""

        id, site, delay = "second", Site.INPUT, "tau"
        parameters = (Parameter("tau", "s", "time", scale=0.01, neutral=0.0),)

        def input(self, q, p, s):
            return q.u + q.late

    with pytest.raises(ValueError, match="a valve has one dead time"):
        kernel((*BASE, "dead_time", "second"), catalogue=CATALOGUE.extended(Second()))
    with pytest.raises(BadInput, match="the motion is imposed"):
        kernel((*BASE, "dead_time"), "motion")


@pytest.mark.parametrize("delay", [0.0, 2e-4, 1e-3, 2.5e-3, 0.0317, 0.1])
def test_the_past_of_the_actuator_is_that_of_a_straight_force(delay):
    substep, way, count = STEP / 5, STEP / 10, len(recall.names(kernel((*BASE, "dead_time")).layout))
    t, now, then, past = ca.SX.sym("t"), ca.SX.sym("now"), ca.SX.sym("then"), ca.SX.sym("past", count)
    held = ca.vertsplit(past)
    function = ca.Function(
        "past", [t, now, then, past],
        [ca.vertcat(*recall.kept(t, now, held, substep)), recall.earlier(t, now, then, way, held, delay, substep)],
    )  # fmt: skip
    state = np.zeros(count)
    for k in range(5 * count):
        middle = (k + 0.5) * substep
        state, found = function(middle, 3 * k * substep, 3 * middle, state)
        if k * substep > 0.1 + STEP:
            assert float(found) == pytest.approx(3 * (middle - delay), abs=1e-9)


def test_the_actuator_takes_a_dead_time_as_hidden_effect():
    inputs = np.zeros((2000, 24))
    inputs[:, :5] = 0.5, 3.5e6, 2.6e6, 20.0, 600e3

    def travel(effects):
        valve = Actuator("lugre", effects=effects)
        return valve.advance(valve.start(), inputs)[1][:, COLUMN["X"]], valve

    plain, _ = travel({})
    neutral, valve = travel({"dead_time": {"tau": 0.0}})
    slow, _ = travel({"dead_time": {"tau": 0.05}})
    assert np.array_equal(plain, neutral)
    assert valve.values["dead_time.tau"] == 0.0
    assert abs(slow - plain).max() > 1e-4
    with pytest.raises(BadInput, match=r"tau is 2 s; in the actuator a dead time is 0\.1 s at most"):
        Actuator("lugre", effects={"dead_time": {"tau": 2.0}})
