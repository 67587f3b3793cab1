"""Presliding hysteresis with non-local memory, by Maxwell-slip elements (equation 2.32-2.35)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing, Trial, stacked
from simulator.imitation import hidden_in_friction
from simulator.play import play

ELEMENTS = 4
"""Number of elements: four bend the transition curve at a quarter, half, three quarters and the whole of its range."""


DEFLECTIONS = (0.7, 1.4, 2.8, 5.6)
"""Where the last element may slip, in deflections of the bristle at break-away, for a first guess."""


class NonlocalPresliding(Effect):
    """F = f/4 sum over i of (x - a_i)/d_i, the anchors a_i dragged along at the distances d_i = i d/4, i = 1..4.

    It is F_h(z) of (2.32) and (2.33) in the finite-state form of Maxwell slip: after every reversal a new transition
    curve starts, and where an inner loop closes, the outer one goes on, which one bristle does not do. Sliding, it is a
    constant friction f; with fc beside it the level S(v) of (2.35) is fc + f.
    """

    id = "nonlocal_presliding"
    site = Site.FORCE
    sentence = "before break-away the packing remembers several reversals, as a stack of contacts that slip in turn"
    check = "a packing of many rings, its compression, and how small reversals of the set point are answered"
    imitated = True
    parameters = (
        Parameter("f", "N", "friction of all elements, sliding", scale=60.0, lower=0.0, neutral=0.0),
        Parameter("d", "m", "displacement at which the last element slips", scale=4e-4, lower=0.0, positive=True),
    )
    memory = tuple(Memory(f"a{i}", "m", at_position=True) for i in range(1, ELEMENTS + 1))
    passive = True

    def jump(self, q: Quantities, p: Values, s: Values) -> Mapping[str, Expression]:
        return {f"a{i}": play(s[f"a{i}"], q.x, 2 * p["d"] * i / ELEMENTS) for i in range(1, ELEMENTS + 1)}

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        bent = sum((q.x - s[f"a{i}"]) / i for i in range(1, ELEMENTS + 1))
        return p["f"] / p["d"] * bent

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """How what is missing against the motion grows with the distance from the last reversals."""

        def trial(d: float) -> Trial:
            return {"d": d}, {"f": lambda r: stacked(r.x, d, ELEMENTS)}

        deflection = base["lugre.fs"] / base["lugre.sigma0"]
        guess = Missing.of(recordings, base, presliding=True).best(
            trial(multiple * deflection) for multiple in DEFLECTIONS
        )
        if guess is None or guess.values["f"] <= 0:
            return []
        return [self.named(**guess.values) | hidden_in_friction(self.parameter_name("f"), guess.values["f"], base)]
