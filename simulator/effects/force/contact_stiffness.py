"""A spring that is met beyond a position: seat, end stop, soft bumper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Trial, along

ROUNDING = 2e-5
"""Distance [m] over which the contact closes: surfaces are rough, and the force stays differentiable."""


class ContactStiffness(Effect):
    """F = k r(x - x0), r(d) = max(d, 0), rounded over 0.02 mm: extra stiffness beyond a position.

    k < 0 stands for a contact below x0, a seat: the spring then has the stiffness of the contact in it and loses it on
    the way up, for max(d, 0) - d = max(-d, 0).
    """

    id = "contact_stiffness"
    site = Site.FORCE
    sentence = "the stem meets an extra stiffness beyond a position: seat, end stop or bumper"
    check = "travel stops, the seat and anything that the stem or the actuator plate can touch there"
    parameters = (
        Parameter("k", "N/m", "extra stiffness; negative: below the position", scale=2e4, neutral=0.0),
        Parameter("x0", "m", "position of the contact", scale=0.012),
    )

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        depth = (q.x - p["x0"]) / ROUNDING
        beyond = ca.if_else(depth > 0, depth, 0.0)
        return p["k"] * ROUNDING * (beyond + ca.log1p(ca.exp(-ca.fabs(depth))))

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """Where the loop of force over position has its kink, and where the measurements pull at one."""

        def trial(x0: float) -> Trial:
            return {"x0": x0}, {"k": lambda r: np.maximum(r.x - x0, 0.0)}

        trials = [trial(x0) for x0 in along(recordings)]
        return self.guessed_shapes(recordings, base, trials, "spring.K", "spring.F0")
