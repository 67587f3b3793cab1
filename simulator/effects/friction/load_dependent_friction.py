"""Friction that grows with the load: seals that pressure presses on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing


class LoadDependentFriction(Effect):
    """Friction level times 1 + c abs(u), u the actuating force at the valve.

    The normal force on a lip seal or a guide grows with the pressure or the side load that comes with the actuating
    force. With the motion imposed, u is the fourth input.
    """

    id = "load_dependent_friction"
    site = Site.FORCE
    sentence = "friction grows with the load, as where pressure presses on a seal or side load on a guide"
    check = "seals of the actuator that pressure energises, side load on the stem, and the supply pressure"
    parameters = (Parameter("c", "1/N", "rise of the friction level per actuating force", scale=5e-4, neutral=0.0),)

    def friction_level(self, q: Quantities, p: Values, s: Values) -> Expression:
        return 1 + p["c"] * ca.fabs(q.u)

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """How what is missing against the motion grows with the force."""
        return self.guessed(Missing.of(recordings, base).best([({}, {"c": lambda r: r.friction(base) * np.abs(r.u)})]))
