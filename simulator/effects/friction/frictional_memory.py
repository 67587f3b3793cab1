"""Friction that lags velocity (equation 2.9)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from recordings import Array
from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing
from simulator.relaxation import Lag


class FrictionalMemory(Effect):
    """The Stribeck curve is read at a late velocity w, tau dw/dt = v - w: v(t - tau) of (2.9) as a first-order lag."""

    id = "frictional_memory"
    site = Site.FORCE
    sentence = "friction follows changes of velocity late, as where a film of lubricant has to form"
    check = "lubricant and its viscosity, and the finish of stem and packing"
    parameters = (Parameter("tau", "s", "time by which friction is late", 0.01, lower=0.0, neutral=0.0),)
    memory = (Memory("w", "m/s"),)

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Lag]:
        return {"w": Lag(q.v, p["tau"])}

    def friction_speed(self, q: Quantities, p: Values, s: Values) -> Expression:
        return s["w"]

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The loop of the friction-velocity map: friction by a late velocity, to first order."""
        return self.guessed(Missing.of(recordings, base).best([({}, {"tau": lambda r: _per_delay(r, base)})]))


def _per_delay(look: FirstLook, base: Mapping[str, float]) -> Array:
    """What a second of delay adds to friction [N]: minus acceleration times the slope of Stribeck's curve."""
    fall, vs = base["lugre.fs"] - base["lugre.fc"], base["lugre.vs"]
    return np.asarray(look.a * fall * 2 * np.abs(look.v) / vs**2 * look.falling(base))
