"""Break-away friction that grows with the time at rest (equation 2.6, 2.7 and 2.10)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from recordings import Array
from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Missing, Trial
from simulator.relaxation import Relaxation

MOST = 1.0
"""Rise of friction of a first guess at most: bristles that are bent otherwise look like more of it."""
RESTS = (0.3, 1.0, 3.0)
"""Times at rest [s] that may bring most of the rise, for a first guess."""


class DwellStiction(Effect):
    """Friction level times 1 + a s, ds/dt = (1 - s)/gamma - abs(v) s/d: at rest (2.6) with m = 1, from any start.

    a is Fs,inf/Fs - 1. s is the share of the rise that is there: it goes on from where the last slip left it, which is
    what (2.7) and (2.10) correct in (2.6), and motion wipes it out over a distance d, so that there are no events. That
    is at most 10 mm, many times a contact: friction that rises while a valve moves up and down is drift.
    (2.7) itself, t/(t + gamma), is alike over a decade of rests.
    """

    id = "dwell_stiction"
    site = Site.FORCE
    sentence = "break-away friction grows with the time at rest"
    check = "the packing for ageing, dried lubricant or adhesion, and how long the valve usually stands still"
    parameters = (
        Parameter("a", "1", "rise of friction after a long rest, share of the level", 0.3, 0.0, neutral=0.0),
        Parameter("gamma", "s", "time at rest that brings 63 % of the rise", scale=1.0, lower=0.0, positive=True),
        Parameter("d", "m", "travel that wipes the rise out to 1/e", scale=5e-4, lower=0.0, upper=0.01, positive=True),
    )  # fmt: skip
    memory = (Memory("s", "1"),)

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Relaxation]:
        return {"s": Relaxation(1 / p["gamma"], 1 / p["gamma"] + ca.fabs(q.v) / p["d"])}

    def friction_level(self, q: Quantities, p: Values, s: Values) -> Expression:
        return 1 + p["a"] * s["s"]

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """What is missing against the motion after rests, by how long they were."""

        def trial(gamma: float) -> Trial:
            d = self.parameters[-1].scale
            return {"gamma": gamma, "d": d}, {"a": lambda r: r.friction(base) * _rested(r, gamma, d)}

        guess = Missing.of(recordings, base, presliding=True).best(map(trial, RESTS))
        return [] if guess is None else [self.named(**guess.values | {"a": min(guess.values["a"], MOST)})]


def _rested(look: FirstLook, gamma: float, d: float) -> Array:
    """The share of the rise that is there at each sample."""
    rates = 1 / gamma + np.abs(look.v[:-1]) / d
    kept, s = np.exp(-rates * np.diff(look.t)), 0.0
    found = [s]
    for keep, most in zip(kept.tolist(), (1 / gamma / rates).tolist(), strict=True):
        s = most + (s - most) * keep
        found.append(s)
    return np.array(found)
