"""A spring that stiffens as it is compressed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing


class HardeningSpring(Effect):
    """F = k3 x^3, beside K x + F0; k3 < 0 is a spring or diaphragm that softens."""

    id = "hardening_spring"
    site = Site.FORCE
    sentence = "the spring stiffens along the stroke, as with coils that close or a diaphragm that stretches"
    check = "the spring's solid length and the effective area of the diaphragm over the stroke"
    parameters = (Parameter("k3", "N/m3", "cubic stiffness", scale=5e6, neutral=0.0),)

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        return p["k3"] * q.x**3

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The curvature of the loop of force over position, and the straight spring beside it."""
        guess = Missing.of(recordings, base).best([({}, {"k3": lambda r: r.x**3})])
        return self.guessed(guess, "spring.K", "spring.F0")
