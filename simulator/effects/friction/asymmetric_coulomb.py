"""Coulomb friction that differs by direction (equation 2.4, a_i)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing


class AsymmetricCoulomb(Effect):
    """Friction level times 1 + a sgn(v): levels a1 = (1 + a) fc and a2 = (1 - a) fc of (2.4), fs alike.

    While the stem slides it is a constant force a fc, which a preload can stand for: only reversals, and a preload that
    is known, tell them apart.
    """

    id = "asymmetric_coulomb"
    site = Site.FORCE
    sentence = "friction is higher in one direction of travel than in the other"
    check = "the packing's lips and wear bands, side load on the stem, and the bench set for a constant force instead"
    parameters = (
        Parameter("a", "1", "excess of friction at rising position, share of the mean level", 0.1, -0.95, 0.95, 0.0),
    )

    def friction_level(self, q: Quantities, p: Values, s: Values) -> Expression:
        return 1 + p["a"] * ca.sign(q.v)

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The part of sliding friction that does not change sign; a preload that is not known takes it."""
        return self.guessed(Missing.of(recordings, base).best([({}, {"a": lambda r: np.abs(r.friction(base))})]))
