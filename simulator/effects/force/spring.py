"""Actuator spring with preload (bench set)."""

from __future__ import annotations

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values


class Spring(Effect):
    """F = K x + F0: linear spring and every constant force on the stem (bench set, weight, mean flow force)."""

    id = "spring"
    site = Site.FORCE
    sentence = "the actuator spring and its preload, which set the bench-set range"
    check = "compare the spring rate and the bench set with the actuator's data sheet"
    parameters = (
        Parameter("K", "N/m", "spring constant", scale=3e4, lower=0.0, positive=True),
        Parameter("F0", "N", "preload: force at x = 0", scale=300.0),
    )

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        return p["K"] * q.x + p["F0"]
