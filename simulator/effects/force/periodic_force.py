"""A disturbance that is periodic in time."""

from __future__ import annotations

import math

import casadi as ca

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, TriedAt, Values


class PeriodicForce(Effect):
    """F = a sin(2 pi f t) + b cos(2 pi f t), t from the recording's own clock; its amplitude is hypot(a, b).

    With a frequency given it is linear in a and b. The frequency has to be found to about a quarter of a period over
    the recording before a fit can refine it.
    """

    id = "periodic_force"
    site = Site.FORCE
    sentence = "a force of its own rhythm acts on the stem: pulsation, vibration or another loop that oscillates"
    check = "pumps, compressors and control loops nearby for the named frequency"
    parameters = (
        Parameter("a", "N", "amplitude of the sine", scale=10.0, neutral=0.0),
        Parameter("b", "N", "amplitude of the cosine", scale=10.0, neutral=0.0),
        Parameter("f", "Hz", "frequency", scale=2.0, lower=0.0, positive=True, tried_at=TriedAt.FREQUENCIES),
    )

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        phase = 2 * math.pi * p["f"] * q.t
        return p["a"] * ca.sin(phase) + p["b"] * ca.cos(phase)
