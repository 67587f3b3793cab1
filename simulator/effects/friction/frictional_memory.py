"""Friction that lags velocity (equation 2.9)."""

from __future__ import annotations

from collections.abc import Mapping

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, TriedAt, Values
from simulator.relaxation import Lag


class FrictionalMemory(Effect):
    """The Stribeck curve is read at a late velocity w, tau dw/dt = v - w: v(t - tau) of (2.9) as a first-order lag."""

    id = "frictional_memory"
    site = Site.FORCE
    sentence = "friction follows changes of velocity late, as where a film of lubricant has to form"
    check = "lubricant and its viscosity, and the finish of stem and packing"
    parameters = (
        Parameter("tau", "s", "time by which friction is late", 0.01, lower=0.0, neutral=0.0, tried_at=TriedAt.SHARES),
    )
    memory = (Memory("w", "m/s"),)

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Lag]:
        return {"w": Lag(q.v, p["tau"])}

    def friction_speed(self, q: Quantities, p: Values, s: Values) -> Expression:
        return s["w"]
