"""The balance of forces on the sliding stem: what the model leaves of it, and which kind of change would do that.

While the stem slides steadily, the force that the model does not explain is known sample by sample, however large the
change, and without a free run of the model through stick and slip, which noise sends astray wherever a stem creeps:
more friction is against the motion in both directions, a weaker spring grows along the stroke with one sign, anything
else that pushes has one sign and keeps it. Each kind alone is fitted to it, and the share that it explains is its
evidence. Motion in one direction only does not tell friction from a push, and then no kind is named.

A wrong position has evidence of its own: the flow says by how much it is wrong, and then the force that is left must be
that of the spring over just this way. Nothing is fitted to it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import copysign, exp, isfinite, nan
from typing import NamedTuple

import numpy as np

from detector.measurements import Measurement, Measurements
from detector.watch.model.filter import DIRECTIONS, ModelFilter
from recordings import Array

N = len(DIRECTIONS)

STEADY, STEP_NOISE = 2.0, 4.0
"""The stem moves steadily when its last step is the usual one within this factor, and so many noise levels: where it
has just started or stopped, the means of position and force are of two states, and their balance is of neither.
"""

MOVING, PRESLIDING = 5.0, 3.0
"""It slides when it is so many noise levels ahead of its mean, and has moved steadily by so many deflections of the
bristle at break-away: before that the friction is on its way up.
"""

MEMORY, SETTLING = 10.0, 5.0
"""Evidence fades with so many samples in motion until an alarm has stood for so many smoothing times, in which the
means of an abrupt change are of two states; from then on it stays.
"""

CLEAR, AHEAD, LEAST = 0.6, 0.15, 12.0
"""A kind is named when it explains so much, so much more than any other kind, with so many samples in motion."""

TOLD = 9.0
"""Twice the logarithm of a likelihood ratio that tells two explanations apart: three standard deviations."""

AGREED = 0.1
"""Flow and forces agree on a wrong position when no more of the force is left than this share: nothing is fitted."""

GAP = 5.0
"""Sampling times without a sample after which the means start anew."""

ONE_WAY = 0.8
"""Motion is in one direction only when the two differ by this share of all of it; then nothing is named."""


class SlidingMoment(NamedTuple):
    """A sample at which the stem slides steadily. way : 1 or -1; position [m], speed [m/s]; level : of the dry friction
    by the model [N]; left : force that the model does not explain [N].
    """

    way: float
    position: float
    speed: float
    level: float
    left: float


class Balance(NamedTuple):
    """position [m], force [N] : means, the force being what the model's spring leaves; last [m] : position; began [m] :
    mean position at which a steady motion began. Of sliding samples, which weight counts, sums of squares and products
    of what each kind predicts: information (n, n), score (n,), energy [N2]. wrong [m] : mean of how far the position is
    from that of the flow; sensor (3,) : where that is known, sums of squares of what it leaves of the force and of the
    force itself [N2], and the weight; stood : samples since an alarm began.
    """

    position: float
    force: float
    last: float
    began: float
    information: Array
    score: Array
    energy: float
    weight: float
    wrong: float = 0.0
    sensor: Array = np.zeros(3)
    stood: float = 0.0


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
        x = moment.values["position"]
        return Balance(x, filter.unexplained(moment), x, x, np.zeros((N, N)), np.zeros(N), 0.0, 0.0)

    def resumed(self, before: Balance, filter: ModelFilter, moment: Measurement) -> Balance:
        """After a gap: the means start anew, the evidence for a kind stays."""
        x = moment.values["position"]
        return before._replace(position=x, force=filter.unexplained(moment), last=x, began=x)

    def step(
        self, before: Balance, filter: ModelFilter, moment: Measurement, alarmed: bool, wrong: float = nan
    ) -> tuple[Balance, SlidingMoment | None]:
        """The sums after one sample, and what it says of the forces where the stem slides steadily. wrong : how far the
        position is from that of the flow [m], NaN where unknown.
        """
        x, follow = moment.values["position"], self._follow
        position = before.position + follow * (x - before.position)
        force = before.force + follow * (filter.unexplained(moment) - before.force)
        known = isfinite(wrong)
        wrong = before.wrong + follow * (wrong - before.wrong) if known else before.wrong
        speed, values = self._speed(x - position, x - before.last, filter.position_noise), filter.values
        slid = copysign(position - before.began, (position - before.began) * speed)
        began = before.began if speed and slid >= 0 else position
        stood = before.stood + 1.0 if alarmed else 0.0
        after = before._replace(position=position, force=force, last=x, began=began, wrong=wrong, stood=stood)
        if not speed or slid < PRESLIDING * values["lugre.fs"] / values["lugre.sigma0"]:
            return after, None
        way = copysign(1.0, speed)
        level = filter.dry_friction(speed)
        seen = SlidingMoment(way, position, speed, level, force - way * level - values["lugre.sigma2"] * speed)
        settled = stood * self.dt_s > SETTLING * self.smoothing_s
        return self._summed(after, seen, values, 1.0 if settled else 1.0 - 1.0 / MEMORY, known), seen

    @cached_property
    def _follow(self) -> float:
        """How far the means follow in one sample."""
        return 1.0 - exp(-self.dt_s / self.smoothing_s)

    def _speed(self, ahead: float, step: float, noise: float) -> float:
        """Of a stem that moves steadily [m/s], 0 where it does not. ahead, step : of its mean, and of the last [m]."""
        if abs(ahead) < MOVING * noise:
            return 0.0
        usual = abs(ahead) * self._follow / (1.0 - self._follow)
        slack, step = STEP_NOISE * noise, copysign(step, step * ahead)
        steady = usual / STEADY - slack <= step <= STEADY * usual + slack
        return copysign(usual / self.dt_s, ahead) if steady else 0.0

    def _summed(
        self, before: Balance, seen: SlidingMoment, values: Mapping[str, float], keep: float, flow_known: bool
    ) -> Balance:
        """The sums with one more sample; what they have fades by `keep`."""
        left = seen.left
        kinds = np.array([seen.way * seen.level, values["spring.K"] * seen.position + values["spring.F0"], 1.0])
        missed = left + values["spring.K"] * before.wrong
        sensor = np.array([missed * missed, left * left, 1.0]) if flow_known else np.zeros(3)
        return before._replace(
            information=keep * before.information + np.outer(kinds, kinds), score=keep * before.score + kinds * left,
            energy=keep * before.energy + left * left, weight=keep * before.weight + 1.0,
            sensor=keep * before.sensor + sensor,
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

    def spring_is_weak(self, filter: ModelFilter, balance: Balance) -> bool | None:
        """Whether it is the spring that pushes along the stroke, and not a wrong scale of the force; None while open.

        A pressure sensor or a diaphragm that gives another force scales the friction as well, and a spring does not.
        """
        force = np.array([1.0, 1.0, 0.0])
        of_force = float(force @ balance.score) ** 2 / max(float(force @ balance.information @ force), 1e-300)
        of_spring = float(balance.score[1]) ** 2 / max(float(balance.information[1, 1]), 1e-300)
        alike = max(2.0 * self.smoothing_s / self.dt_s, 1.0)
        told = (of_spring - of_force) / (alike * max(self.usual, filter.force_noise**2))
        return None if abs(told) < TOLD else told > 0

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


def sliding(filter: ModelFilter, data: Measurements) -> list[SlidingMoment | None]:
    """What every sample of fault-free data says of the forces, None where the stem does not slide steadily."""
    test, state, found = BalanceTest(filter.dt_s, filter.smoothing_s), None, list[SlidingMoment | None]()
    last_s = -np.inf
    for moment in data:
        seen = None
        if np.isfinite(moment.values["position"] + filter.force(moment)):
            if state is None:
                state = test.start(filter, moment)
            elif moment.time_s - last_s > GAP * filter.dt_s:
                state = test.resumed(state, filter, moment)
            else:
                state, seen = test.step(state, filter, moment, False)
            last_s = moment.time_s
        found.append(seen)
    return found


def forces(found: Sequence[SlidingMoment | None]) -> Array:
    """Unexplained forces (n_samples, 2) [N]: against the motion, and along the stroke; NaN where there are none."""
    return np.array([(nan, nan) if one is None else (one.way * one.left, one.left) for one in found]).reshape(-1, 2)
