"""Moving mass of stem, plug and diaphragm plate."""

from __future__ import annotations

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values


class Inertia(Effect):
    """F = m a: Newton's second law for the moving parts."""

    id = "inertia"
    site = Site.FORCE
    prefix = "mass"
    sentence = "the moving mass of stem, plug and diaphragm plate"
    check = "weigh the parts or take the mass from the drawing; it shows only when the stem accelerates fast"
    parameters = (Parameter("m", "kg", "moving mass", scale=3.0, lower=0.0, positive=True),)

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        return p["m"] * q.a
