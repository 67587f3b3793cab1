"""The positioner: set-point filter, sampled proportional controller, E/P transducer, and the feedback lever.

Source: block diagram of DABLib v1.22 (Bartyś & Syfert, 2002).
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from simulator._effect import Expression
from simulator.damadics._expressions import Knots, clip, play, table

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


def lever(position: Expression, before: Expression, f: Any) -> Expression:
    """Position of the feedback lever [share of the stroke]: f15 is a play between rod and lever."""
    return play(clip(position, -0.25, 1.25), before, f[15])


def process_value(at: Expression, p: Any) -> Expression:
    """What the controller sees of a lever position: an arcsine, exact at 0, 50 and 100 %."""
    return ca.asin(clip(at - 0.5, -1.0, 1.0)) / _LEVER_ANGLE + 0.5


def controller(filtered: Expression, value: Expression, p: Any) -> Expression:
    """CVI: output of the controller, -1 (vent) to 1 (fill)."""
    return clip(p.gain * (filtered - value), -1.0, 1.0)


def transducer(cvi: Expression, f: Any, sense: Expression) -> Expression:
    """CVP: opening of the pneumatic relay, -1 to 1; f12 is a gain error."""
    return clip(table(cvi, TRANSDUCER) * (1 + sense * f[12]), -1.0, 1.0)
