"""Break-away friction that grows with the time at rest (equation 2.6, 2.7 and 2.10)."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, TriedAt, Values
from simulator.relaxation import Relaxation


class DwellStiction(Effect):
    """Friction level times 1 + a s, ds/dt = (1 - s)/gamma - abs(v) s/d: at rest (2.6) with m = 1, from any start.

    a is Fs,inf/Fs - 1. s is the share of the rise that is there: it goes on from where the last slip left it, which is
    what (2.7) and (2.10) correct in (2.6), and motion wipes it out over a distance d, so that there are no events.
    (2.7) itself, t/(t + gamma), is alike over a decade of rests.
    """

    id = "dwell_stiction"
    site = Site.FORCE
    sentence = "break-away friction grows with the time at rest"
    check = "the packing for ageing, dried lubricant or adhesion, and how long the valve usually stands still"
    parameters = (
        Parameter("a", "1", "rise of friction after a long rest, share of the level", 0.3, 0.0, neutral=0.0,
                  tried_at=TriedAt.SHARES),
        Parameter("gamma", "s", "time at rest that brings 63 % of the rise", scale=1.0, lower=0.0, positive=True),
        Parameter("d", "m", "travel that wipes the rise out to 1/e", scale=5e-4, lower=0.0, positive=True),
    )  # fmt: skip
    memory = (Memory("s", "1"),)

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Relaxation]:
        return {"s": Relaxation(1 / p["gamma"], 1 / p["gamma"] + ca.fabs(q.v) / p["d"])}

    def friction_level(self, q: Quantities, p: Values, s: Values) -> Expression:
        return 1 + p["a"] * s["s"]
