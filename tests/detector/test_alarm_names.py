"""The evidence for the name of an alarm: whether flow and forces agree by how much the position is wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from watched_valve import MODEL

from detector import Measurement
from detector.watch.flow_relation import FlowRelation
from detector.watch.force_balance import BalanceTest
from detector.watch.model.filter import ModelFilter

DT_S, NOISE = 0.1, 2e-5
FLOW = FlowRelation("flow", (0.005, 0.015, 0.025, 0.035), (1.0, 3.0, 5.0, 7.0), 0.02, 0.0, 1e300)
FILTER = ModelFilter(MODEL.effects, MODEL.values, None, NOISE, 5.0, NOISE, DT_S, 0.3)
TEST = BalanceTest(DT_S, 0.3, usual=100.0)


def told(*, moves: float = 0.008, sensor: float = 0.0, flow: float = 1.0, push: float = 0.0) -> bool | None:
    """What the balance says of the position after a minute. sensor : error of the position [m]; flow : factor on the
    flow; push : a force on the plug [N].
    """
    values, balance = MODEL.values, None
    t = DT_S * np.arange(600)
    x, way = 0.02 + moves * np.sin(2 * np.pi * t / 15.0), np.sign(np.cos(2 * np.pi * t / 15.0))
    speed = moves * 2 * np.pi / 15.0 * np.cos(2 * np.pi * t / 15.0)
    friction = (values["lugre.fc"] * way + values["lugre.sigma2"] * speed) * (moves > 0)
    force = values["spring.K"] * x + values["spring.F0"] + friction + push
    rows = zip(t.tolist(), (x + sensor).tolist(), force.tolist(), (flow * (200.0 * x)).tolist(), strict=True)
    for time_s, position, pushed, passed in rows:
        moment = Measurement(time_s, {"position": position, "force": pushed, "flow": passed})
        wrong = FLOW.position_error(moment)
        balance = (
            TEST.start(FILTER, moment)
            if balance is None
            else TEST.step(balance, FILTER, moment, time_s > 5.0, wrong)[0]
        )
    return TEST.position_is_wrong(FILTER, balance)


@pytest.mark.parametrize("error", [-0.006, 0.003])
def test_a_wrong_position_that_flow_and_forces_agree_on_is_the_sensor(error):
    assert told(sensor=error) is True


def test_a_flow_that_is_wrong_alone_is_not_the_sensor():
    assert told(flow=0.7, push=150.0) is False


def test_a_stem_that_rests_leaves_it_open_and_so_does_a_valve_in_good_order():
    assert told(moves=0.0, sensor=0.003) is None
    assert told() is None


def test_the_flow_says_where_the_stem_is_and_is_silent_where_it_cannot():
    def error(position: float, flow: float, relation: FlowRelation = FLOW) -> float:
        return relation.position_error(Measurement(0.0, {"position": position, "flow": flow}))

    assert error(0.02, 4.0) == pytest.approx(0.0, abs=1e-12)
    assert error(0.023, 4.0) == pytest.approx(0.003)
    assert math.isnan(error(0.02, 9.0))
    assert math.isnan(error(0.02, math.nan))
    falling = FlowRelation("flow", FLOW.knots, FLOW.heights[::-1], 0.02, 0.0, 1e300)
    assert error(0.02, 4.0, falling) == pytest.approx(0.0, abs=1e-12)
    bent = FlowRelation("flow", FLOW.knots, (1.0, 5.0, 3.0, 7.0), 0.02, 0.0, 1e300)
    assert math.isnan(error(0.02, 4.0, bent))


@pytest.mark.parametrize(("grown", "kind"), [(1.0, None), (1.8, "friction")])
def test_a_fit_that_tells_the_friction_at_the_speeds_of_its_data_alone_names_it(grown, kind):
    values = MODEL.values | {"lugre.fc": 728.0, "lugre.fs": 108.0, "lugre.vs": 7e-3}
    fitted, balance, test = replace(FILTER, values=values), None, replace(TEST, usual=2000.0)
    t = DT_S * np.arange(900)
    x, speed = 0.02 + 8e-3 * np.sin(2 * np.pi * t / 15.0), 8e-3 * 2 * np.pi / 15.0 * np.cos(2 * np.pi * t / 15.0)
    dry = (728.0 - 620.0 * np.exp(-((speed / 7e-3) ** 2))) * np.sign(speed)
    force = values["spring.K"] * x + values["spring.F0"] + grown * dry + values["lugre.sigma2"] * speed
    for time_s, position, pushed in zip(t.tolist(), x.tolist(), force.tolist(), strict=True):
        moment = Measurement(time_s, {"position": position, "force": pushed})
        balance = test.start(fitted, moment) if balance is None else test.step(balance, fitted, moment, time_s > 5.0)[0]
    assert balance is not None
    assert test.kind(fitted, balance) == kind
