"""Friction that varies along the stroke: tight spots, scoring, a bent stem (equation 2.23-2.26)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import AddedForce, FirstLook, Trial, local_shapes


class PositionDependentFriction(Effect):
    """Friction level times 1 + a exp(-((x - x0)/w)^2) + b x: alpha(x, v) of (2.23), an element of (2.25) and a slope.

    A narrow element is a tight spot or a score mark, one as wide as half the stroke a bow; the slope is a stem that
    runs out of line. a < 0 is a worn place.
    """

    id = "position_dependent_friction"
    site = Site.FORCE
    sentence = "friction varies along the stroke: a tight spot, scoring, or a stem that runs out of line"
    check = "stem and guides at the named place for scoring, deposits and bending"
    parameters = (
        Parameter("a", "1", "rise of friction at the place, share of the level", scale=0.4, lower=-1.0, neutral=0.0),
        Parameter("x0", "m", "place of the rise", scale=0.012),
        Parameter("w", "m", "half width of the rise, where it has fallen to 1/e", 0.004, 0.0, positive=True),
        Parameter("b", "1/m", "slope of friction along the stroke, per level at x = 0", scale=10.0, neutral=0.0),
    )  # fmt: skip

    def friction_level(self, q: Quantities, p: Values, s: Values) -> Expression:
        return 1 + p["a"] * ca.exp(-(((q.x - p["x0"]) / p["w"]) ** 2)) + p["b"] * q.x

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The bells along the stroke that explain most of what is missing, and at which the measurements pull most."""

        def trial(x0: float, w: float) -> Trial:
            bell: AddedForce = lambda r: r.friction(base) * np.exp(-(((r.x - x0) / w) ** 2))  # noqa: E731
            return {"x0": x0, "w": w}, {"a": bell, "b": lambda r: r.friction(base) * r.x}

        return self.guessed_shapes(recordings, base, [trial(*shape) for shape in local_shapes(recordings)])
