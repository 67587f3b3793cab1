"""The positioner: set-point filter, sampled proportional controller, E/P transducer, and the feedback lever.

Source: block diagram of DABLib v1.22 (Bartyś & Syfert, 2002).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

from simulator.damadics.actuator.expressions import Knots, clip, play, table
from simulator.effect import Expression

TRANSDUCER: Knots = ((-0.94, -0.55), (-0.54, -0.02), (0.46, 0.02), (0.86, 1.0))
"""Controller output to opening of the pneumatic relay: a dead zone, and venting weaker than filling."""

_LEVER_ANGLE = ca.pi / 3
"""The lever turns by 60 degrees over the stroke."""

SETPOINT_LIMIT = 1.024


def filter_rates(q1: Expression, q2: Expression, setpoint: Expression, p: Any) -> tuple[Expression, Expression]:
    """Rates of the two states of the set-point filter [1/s]."""
    return (clip(setpoint, 0.0, SETPOINT_LIMIT) - q1) / p.filter_time, (q1 - q2) / p.filter_time


def sensed(position: Expression, f: Any) -> Expression:
    """Position of the rod [share of the stroke] as its sensor has it; f13 is a gain error."""
    return position * (1 + 1.25 * f[13])


def sampled(reported: Expression, state: Mapping[str, Expression], f: Any, p: Any) -> tuple[Expression, Expression]:
    """Feedback lever [share of the stroke] and CVI, the controller's output from -1 (vent) to 1 (fill).

    reported : position [share of the stroke]; state : the ``lever`` before, the filtered set point ``q2``, and ``cvi``,
    which is held until ``tick`` is 0. f15 is a play of the lever.
    """
    lever = play(clip(sensed(reported, f), -0.25, 1.25), state["lever"], f[15])
    command = clip(p.gain * (state["q2"] - _process_value(lever)), -1.0, 1.0)
    return lever, ca.if_else(state["tick"] < 0.5, command, state["cvi"])


def next_tick(tick: Expression, period: Expression) -> Expression:
    """The counter of steps since the controller sampled, 0 when it does."""
    return ca.if_else(tick + 1.5 > period, 0.0, tick + 1)


def transducer(cvi: Expression, f: Any, sense: Expression) -> Expression:
    """CVP: opening of the pneumatic relay, -1 to 1; f12 is a gain error."""
    return clip(table(cvi, TRANSDUCER) * (1 + sense * f[12]), -1.0, 1.0)


def _process_value(lever: Expression) -> Expression:
    """What the controller sees of a lever position: an arcsine, exact at 0, 50 and 100 %."""
    return ca.asin(clip(lever - 0.5, -1.0, 1.0)) / _LEVER_ANGLE + 0.5
