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

from detector.arithmetic.native import native
from detector.measurements import Measurement, Measurements
from detector.watch.model.filter import DIRECTIONS, ModelFilter
from recordings import Array

N = len(DIRECTIONS)

QUICKER, STEADY, STEP_NOISE = 3.0, 1.5, 4.0
"""The stem moves steadily when a mean that is so much quicker gives the same speed, within this factor and so many
noise levels: where it has just started or stopped, the means of position and force are of two states, and their balance
is of neither.
"""

EVEN = 0.05
"""Its force is even when it is within so much of the dry friction, and as many noise levels, of its mean."""

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
    """position [m], force [N] : means, the force being what the model's spring leaves; quick [m] : mean of a shorter
    time; began [m] : position at which a steady motion began. Of sliding samples, which weight counts, sums of squares
    and products of what each kind predicts: information (n, n), score (n,), energy [N2]. wrong [m] : mean of how far
    the position is from that of the flow; sensor (3,) : where that is known, sums of squares of what it leaves of the
    force and of the force itself [N2], and the weight; stood : samples since an alarm began.
    """

    position: float
    force: float
    quick: float
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
        return before._replace(position=x, force=filter.unexplained(moment), quick=x, began=x)

    def step(
        self, before: Balance, filter: ModelFilter, moment: Measurement, alarmed: bool, wrong: float = nan
    ) -> tuple[Balance, SlidingMoment | None]:
        """The sums after one sample, and what it says of the forces where the stem slides steadily. wrong : how far the
        position is from that of the flow [m], NaN where unknown.
        """
        unexplained = filter.unexplained(moment)
        after, speed = self._followed(before, filter, moment, unexplained, wrong)
        after = after._replace(stood=before.stood + 1.0 if alarmed else 0.0)
        seen = self._slides(after, filter, moment.values["position"], unexplained, speed)
        if seen is None:
            return after, None
        settled = after.stood * self.dt_s > SETTLING * self.smoothing_s
        keep = 1.0 if settled else 1.0 - 1.0 / MEMORY
        return self._summed(after, seen, filter.values, keep, isfinite(wrong)), seen

    def _followed(
        self, before: Balance, filter: ModelFilter, moment: Measurement, unexplained: float, wrong: float
    ) -> tuple[Balance, float]:
        """The means after one sample, and the speed of a steady motion [m/s]."""
        x, follow = moment.values["position"], self._follow
        position = before.position + follow * (x - before.position)
        force = before.force + follow * (unexplained - before.force)
        wrong = before.wrong + follow * (wrong - before.wrong) if isfinite(wrong) else before.wrong
        quick = before.quick + self._follow_quickly * (x - before.quick)
        speed = self._speed(x - position, x - quick, filter.position_noise)
        began = before.began if speed * (x - before.began) > 0.0 else x
        return before._replace(position=position, force=force, quick=quick, began=began, wrong=wrong), speed

    def _slides(
        self, after: Balance, filter: ModelFilter, x: float, unexplained: float, speed: float
    ) -> SlidingMoment | None:
        """The sample, where the stem slides by now and its force is even."""
        values, way, level = filter.values, copysign(1.0, speed), filter.dry_friction(speed)
        least = max(PRESLIDING * values["lugre.fs"] / values["lugre.sigma0"], MOVING * filter.position_noise)
        if not speed or abs(x - after.began) < least:
            return None
        if abs(unexplained - after.force) > STEP_NOISE * filter.force_noise + EVEN * level:
            return None
        left = after.force - way * level - values["lugre.sigma2"] * speed
        return SlidingMoment(way, after.position, speed, level, left)

    @cached_property
    def _follow(self) -> float:
        """How far the means follow in one sample."""
        return 1.0 - exp(-self.dt_s / self.smoothing_s)

    @cached_property
    def _follow_quickly(self) -> float:
        """The same of the quick mean."""
        return 1.0 - exp(-QUICKER * self.dt_s / self.smoothing_s)

    def _speed(self, ahead: float, quickly: float, noise: float) -> float:
        """Of a stem that moves steadily [m/s], 0 where it does not. ahead, quickly : of its two means [m]."""
        if abs(ahead) < MOVING * noise:
            return 0.0
        usual = abs(ahead) * self._follow / (1.0 - self._follow)
        per_step = self._follow_quickly / (1.0 - self._follow_quickly)
        slack, step = per_step * STEP_NOISE * noise, per_step * copysign(quickly, quickly * ahead)
        steady = usual / STEADY - slack <= step <= STEADY * usual + slack
        return copysign(usual / self.dt_s, ahead) if steady else 0.0

    def _summed(
        self, before: Balance, seen: SlidingMoment, values: Mapping[str, float], keep: float, flow_known: bool
    ) -> Balance:
        """The sums with one more sample; what they have fades by `keep`."""
        spring = values["spring.K"] * seen.position + values["spring.F0"]
        missed = seen.left + values["spring.K"] * before.wrong if flow_known else nan
        information, score, sensor = _with_one_more(
            before.information, before.score, before.sensor, keep, seen.way * seen.level, spring, seen.left, missed
        )
        return before._replace(
            information=information, score=score, energy=keep * before.energy + seen.left * seen.left,
            weight=keep * before.weight + 1.0, sensor=sensor,
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


@native
def _with_one_more(
    information: Array, score: Array, sensor: Array, keep: float, friction: float, spring: float, left: float,
    missed: float,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Sums of a `Balance` with one more sample: what each kind predicts of a force, the force that is left, and what
    a wrong position misses of it, NaN where that is not known.
    """
    kinds, added, scored, seen = (friction, spring, 1.0), np.empty((N, N)), np.empty(N), keep * sensor
    for i in range(N):
        scored[i] = keep * score[i] + kinds[i] * left
        for j in range(N):
            added[i, j] = keep * information[i, j] + kinds[i] * kinds[j]
    if np.isfinite(missed):
        seen[0] += missed * missed
        seen[1] += left * left
        seen[2] += 1.0
    return added, scored, seen


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
