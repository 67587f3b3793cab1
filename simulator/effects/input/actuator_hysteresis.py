"""Hysteresis between drive and force, by play operators (equation 2.39-2.69 in finite-state form)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing, Trial, stacked
from simulator.imitation import hidden_in_friction
from simulator.play import play

ELEMENTS = 4
"""Number of play operators: they bend the branches of the loop at a quarter, half, three quarters and all of it."""


WAYS = (0.4, 0.8, 1.6, 3.2, 6.4)
"""Half the changes of the drive that may complete a branch, in Coulomb frictions, for a first guess."""


class ActuatorHysteresis(Effect):
    """u -> u - h/4 sum over i of (u - w_i)/r_i, the w_i dragged along by u at the distances r_i = i r/4, i = 1..4.

    A Prandtl-Ishlinskii stack: the Preisach operator (2.52) with a weight on few lines alpha - beta = 2 r_i, so minor
    loops close, wipe out and are congruent. After a one-way change of u by 2 r the force is h behind, as w of (2.39)
    comes to be (c - B1)/alpha behind (2.42, 2.43).
    """

    id = "actuator_hysteresis"
    site = Site.INPUT
    sentence = "there is hysteresis between drive and force: a reversal of the drive is answered in part at first"
    check = "diaphragm, bellows and linkage of the actuator, and the transducer on the bench, up and down"
    imitated = True
    parameters = (
        Parameter("h", "N", "half width of the full loop", scale=30.0, lower=0.0, neutral=0.0),
        Parameter("r", "N", "half the change of the drive that completes a branch", 100.0, lower=0.0, positive=True),
    )
    memory = tuple(Memory(f"w{i}", "N", at_force=True) for i in range(1, ELEMENTS + 1))

    def jump(self, q: Quantities, p: Values, s: Values) -> Mapping[str, Expression]:
        return {f"w{i}": play(s[f"w{i}"], q.u, 2 * p["r"] * i / ELEMENTS) for i in range(1, ELEMENTS + 1)}

    def input(self, q: Quantities, p: Values, s: Values) -> Expression:
        behind = sum((q.u - s[f"w{i}"]) / i for i in range(1, ELEMENTS + 1))
        return q.u - p["h"] / p["r"] * behind

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """How what is missing grows with the change of the force since its last reversals, and what is usual: a narrow
        loop is over before the valve breaks away, and most of it looks like friction.
        """
        h, r = self.parameters
        usual = {self.parameter_name("r"): r.scale} | hidden_in_friction(self.parameter_name("h"), h.scale, base)

        def trial(r: float) -> Trial:
            return {"r": r}, {"h": lambda look: stacked(look.u, r, ELEMENTS)}

        guess = Missing.of(recordings, base, presliding=True).best(trial(way * base["lugre.fc"]) for way in WAYS)
        if guess is None or guess.values["h"] <= 0:
            return [usual]
        read = self.named(**guess.values) | hidden_in_friction(self.parameter_name("h"), guess.values["h"], base)
        return [read, usual]
