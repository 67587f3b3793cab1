"""Friction that varies along the stroke and with speed: alpha(x, v) of several bells (equation 2.23-2.26)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import AddedForce, FirstLook, Trial, local_shapes

BELLS = 3
"""Number of bells: three make a profile of any bow along a stretch of the stroke."""
SPACING = 1.5
"""Distance of two bells in half widths: their sum is even where their strengths are equal."""
LEAST = -0.8
"""Least strength of a bell: three of it add up to 0.97 at most, so that the friction level stays positive."""


SPEEDS = (0.03, 0.1)
"""Speeds [m/s] at which the rise may have fallen to 1/e, for a first guess."""


class PositionSpeedFriction(Effect):
    """Friction level times 1 + sum over i of a_i exp(-((x - x_i)/w)^2 - (v/u)^2), x_i = x0 + 1.5 (i - 2) w, i = 1..3.

    It is the network (2.25) for the level g = sigma0/alpha, linear in the weights a_i, with bells of position and
    velocity. Each is loudest at rest: what is rough when slow may ride on its film when fast. Far below u it is a
    profile along the stroke; one tight spot alone is position_dependent_friction.
    """

    id = "position_speed_friction"
    site = Site.FORCE
    sentence = "friction varies along the stroke in several places, and the more so the slower the stem moves"
    check = "stem and guides along the named stretch for wear, deposits and lack of lubricant; move it slowly and fast"
    parameters = (
        *(
            Parameter(f"a{i}", "1", f"rise of friction at bell {i}, share of the level", 0.4, lower=LEAST, neutral=0.0)
            for i in range(1, BELLS + 1)
        ),
        Parameter("x0", "m", "place of the middle bell", scale=0.012),
        Parameter("w", "m", "half width of a bell, where it has fallen to 1/e", 0.004, 0.0, positive=True),
        Parameter("u", "m/s", "speed at which the rise has fallen to 1/e", 0.1, 0.0, positive=True),
    )  # fmt: skip

    def friction_level(self, q: Quantities, p: Values, s: Values) -> Expression:
        middle = (BELLS + 1) / 2
        bells = sum(
            p[f"a{i}"] * ca.exp(-(((q.x - p["x0"]) / p["w"] - SPACING * (i - middle)) ** 2))
            for i in range(1, BELLS + 1)
        )
        return 1 + bells * ca.exp(-((q.v / p["u"]) ** 2))

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The bells along the stroke that explain most of what is missing, and at which the measurements pull most."""

        def trial(shape: tuple[float, float], u: float) -> Trial:
            x0, w = shape
            bells = {f"a{i}": _bell(base, x0 + SPACING * (i - (BELLS + 1) / 2) * w, w, u) for i in range(1, BELLS + 1)}
            return {"x0": x0, "w": w, "u": u}, bells

        shapes = itertools.product(local_shapes(recordings), SPEEDS)
        return self.guessed_shapes(recordings, base, [trial(*shape) for shape in shapes])


def _bell(base: Mapping[str, float], x: float, w: float, u: float) -> AddedForce:
    """What a rise of one by a bell at x adds to friction."""
    return lambda r: r.friction(base) * np.exp(-(((r.x - x) / w) ** 2) - (r.v / u) ** 2)
