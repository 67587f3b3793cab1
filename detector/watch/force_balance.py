"""Which kind of change: the balance of forces on the moving stem, compared with what each kind would do to it.

While the stem slides, the force that the model does not explain is known sample by sample, however large the change:
more friction is against the motion in both directions, a weaker spring grows along the stroke with one sign, anything
else that pushes has one sign and keeps it. Each kind alone is fitted to it, and the share that it explains is its
evidence. Motion in one direction only does not tell friction from a push, and then no kind is named.

A wrong position has evidence of its own: the flow says by how much it is wrong, and then the force that is left must be
that of the spring over just this way. Nothing is fitted to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, exp, isfinite, nan
from typing import NamedTuple

import numpy as np

from detector.measurements import Measurement
from detector.watch.model.filter import DIRECTIONS, ModelFilter
from recordings import Array

N = len(DIRECTIONS)

MOVING = 5.0
"""The stem moves when it is so many noise levels ahead of its mean."""

MEMORY = 10.0
"""Evidence from before an alarm fades with so many samples in motion; from the alarm on it stays."""

CLEAR, AHEAD, LEAST = 0.6, 0.15, 12.0
"""A kind is named when it explains so much, so much more than any other kind, with so many samples in motion."""

AGREED = 0.1
"""Flow and forces agree on a wrong position when no more of the force is left than this share: nothing is fitted."""

ONE_WAY = 0.8
"""Motion is in one direction only when the two differ by this share of all of it; then nothing is named."""


class Balance(NamedTuple):
    """Means of position [m] and unexplained force [N], sums of squares and products of what each kind predicts, and
    weight : how many samples in motion they stand for. information (n, n), score (n,); wrong : mean of how far the
    position is from that of the flow [m]; sensor (3,) : where that is known, sums of squares of what it leaves of the
    force and of the force itself [N2], and the weight.
    """

    position: float
    force: float
    information: Array
    score: Array
    energy: float
    weight: float
    wrong: float = 0.0
    sensor: Array = np.zeros(3)


@dataclass(frozen=True)
class BalanceTest:
    """dt_s : sampling time [s]; smoothing_s : time constant of the means [s]; usual : mean square of the unexplained
    force without a fault [N2].
    """

    dt_s: float
    smoothing_s: float
    usual: float = 0.0

    def start(self, filter: ModelFilter, moment: Measurement) -> Balance:
        """Nothing known."""
        return Balance(moment.values["position"], _unexplained(filter, moment), np.zeros((N, N)), np.zeros(N), 0.0, 0.0)

    def step(
        self, before: Balance, filter: ModelFilter, moment: Measurement, alarmed: bool, wrong: float = nan
    ) -> Balance:
        """The sums after one sample. wrong : how far the position is from that of the flow [m], NaN where unknown."""
        follow = 1.0 - exp(-self.dt_s / self.smoothing_s)
        x = moment.values["position"]
        position = before.position + follow * (x - before.position)
        force = before.force + follow * (_unexplained(filter, moment) - before.force)
        known = isfinite(wrong)
        wrong = before.wrong + follow * (wrong - before.wrong) if known else before.wrong
        keep = 1.0 if alarmed else 1.0 - 1.0 / MEMORY
        ahead = x - position
        if abs(ahead) < MOVING * filter.position_noise:
            return before._replace(position=position, force=force, wrong=wrong)
        way, speed = copysign(1.0, ahead), ahead * follow / self.dt_s
        level = _sliding(filter, speed)
        left = force - way * level - filter.values["lugre.sigma2"] * speed
        kinds = np.array([way * level, filter.values["spring.K"] * position + filter.values["spring.F0"], 1.0])
        missed = left + filter.values["spring.K"] * wrong
        sensor = np.array([missed * missed, left * left, 1.0]) if known else np.zeros(3)
        return Balance(
            position, force, keep * before.information + np.outer(kinds, kinds), keep * before.score + kinds * left,
            keep * before.energy + left * left, keep * before.weight + 1.0,
            wrong, keep * before.sensor + sensor,
        )  # fmt: skip

    def kind(self, filter: ModelFilter, balance: Balance) -> str | None:
        """The one of `DIRECTIONS` that explains the unexplained force; None when none does, or several do."""
        if balance.weight < LEAST or balance.energy < self._least(filter) * balance.weight:
            return None
        matrix = balance.information
        if abs(matrix[0, 2]) > ONE_WAY * np.sqrt(matrix[0, 0] * matrix[2, 2]):
            return None
        found = shares(balance)
        friction, pushes = found[0], found[1:]
        best = int(np.argmax(found))
        rival = float(np.max(pushes)) if best == 0 else float(friction)
        return DIRECTIONS[best] if found[best] >= CLEAR and found[best] - rival >= AHEAD else None

    def position_is_wrong(self, filter: ModelFilter, balance: Balance) -> bool | None:
        """Whether the position sensor explains force and flow together; None while too little has moved to say.

        It does when the way by which the flow says that the position is wrong explains the force that is left, and
        does not when more is left with it than without.
        """
        missed, energy, weight = balance.sensor.tolist()
        if weight < LEAST or energy < self._least(filter) * weight:
            return None
        if missed <= AGREED * energy:
            return True
        return False if missed >= energy else None

    def _least(self, filter: ModelFilter) -> float:
        """Mean square of a force that is worth a name [N2]."""
        return max(2.0 * self.usual, (0.2 * min(filter.values["lugre.fc"], filter.values["lugre.fs"])) ** 2)


def shares(balance: Balance) -> Array:
    """How much of the unexplained force each kind alone explains, (n_directions,), from 0 to 1."""
    information = np.maximum(np.diag(balance.information), 1e-300)
    return balance.score**2 / information / max(balance.energy, 1e-300)


def _sliding(filter: ModelFilter, speed: float) -> float:
    """The dry friction at a speed [N]: a fit may tell it at the speeds of its data alone, and not where it ends."""
    values = filter.values
    near = exp(-((speed / values["lugre.vs"]) ** 2))
    return values["lugre.fc"] + (values["lugre.fs"] - values["lugre.fc"]) * near


def _unexplained(filter: ModelFilter, moment: Measurement) -> float:
    """Force on the stem less spring and loads [N]: the friction, as far as the model is right."""
    x = moment.values["position"]
    return filter.net_force(moment) - filter.values["spring.K"] * x - filter.values["spring.F0"]
