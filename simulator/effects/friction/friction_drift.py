"""Friction that changes while one measures: wear, temperature, drying lubricant."""

from __future__ import annotations

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values


class FrictionDrift(Effect):
    """Friction level times 1 + r t, t from the recording's own clock."""

    id = "friction_drift"
    site = Site.FORCE
    sentence = "friction drifts during the recording, as with temperature, wear or a packing that runs in"
    check = "the temperature of packing and medium, recent tightening of the gland, and lubrication"
    parameters = (Parameter("r", "1/s", "change of the friction level per time, share of it", scale=3e-3, neutral=0.0),)

    def friction_level(self, q: Quantities, p: Values, s: Values) -> Expression:
        return 1 + p["r"] * q.t
