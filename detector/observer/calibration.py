"""The observer set up for one valve: its scaling, estimates, networks, velocity filter and threshold.

In service the laws (4.20) run, and so the observer follows what drifts. Their sets are about what was learned, and so
small that in all they can raise the threshold by `RAISED` of its least value, and take `FOLLOWED` of that out of the
residual. So the detector cannot go deaf: a fault that takes the residual of an observer that does not adapt to
`DEAF_BELOW` thresholds is above the threshold of the one that does, however slowly it came.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from detector.measurements import Measurement, Measurements
from detector.observer import kernel
from detector.observer.alarm_rule import AlarmRule
from detector.observer.approximators import HighOrder
from detector.observer.observer import Bounds, Observer, Start
from detector.observer.screening import SampleVerdict, Screening
from detector.observer.state import Decision, Decisions, ObserverState
from detector.observer.velocity import Kalman, SteadyKalman
from recordings import Array

DEAD_ZONE, CONSECUTIVE = 0.8, 2
"""Phi adapts while the residual is above this share of rho; so many samples above rho in a row are an alarm."""

RAISED, FOLLOWED = 0.5, 0.5
"""Shares of the least threshold: by how much the laws may raise it, and how much of a residual they may take away."""

DEAF_BELOW = 1.0 + RAISED + FOLLOWED

ADAPT_S = 1800.0
"""Time [s] in which the law of an alpha follows at full signal: a fault is found in seconds, a drift takes hours."""

SETTLE_SAMPLES, SETTLE_S, GAP_SAMPLES = 30, 1.0, 5

ORDER1, ORDER2 = 2, 5
"""Degrees of the networks S1 and S2, as in Section 4.4."""

_RESTING = 0.1
"""A stem moves from this share of its usual top speed on."""


@dataclass(frozen=True)
class Calibration:
    """An observer in scaled units, x1 = (position - position_zero) / position_span and so for the input.

    input : the signal that stands for u; alpha1, alpha4, alpha5, e1, b1, w1, w2 : learned estimates of the observer
    [1/s, 1/s2, 1/s2, 1/s, span/s2, 1/s, span/s2]; noise : of x1 [span]; jerk : of the velocity filter [span2/s5];
    dt_s : sampling time [s]; error : standard deviation of the model error [span/s2]; top_speed, top_position,
    top_input : largest sizes of x2 [span/s], x1 and u without a fault; adapts : whether the laws run in service.
    """

    input: str
    position_zero: float
    position_span: float
    input_zero: float
    input_span: float
    alpha1: float
    alpha4: float
    alpha5: float
    b1: float
    noise: float
    jerk: float
    dt_s: float
    error: float
    top_speed: float = 1.0
    top_position: float = 0.5
    top_input: float = 0.5
    e1: float = 0.0
    w1: tuple[float, ...] = ()
    w2: tuple[float, ...] = ()
    adapts: bool = True

    @cached_property
    def observer(self) -> Observer:
        """The observer with everything that was learned; its velocity is that of filterpy's Kalman filter."""
        screening = Screening(gap_s=max(GAP_SAMPLES * self.dt_s, 0.5), top_speed=max(20.0, 2.0 / self.dt_s))
        return Observer(
            s1=self.networks[0], s2=self.networks[1],
            start=Start(self.alpha1, self.alpha4, self.alpha5, self.e1, self.b1, self.w1, self.w2), bounds=self.bounds,
            weight_gain=self.weight_gains(1.0 * self.adapts), alpha_gain=self._alpha_gains, sigm="sat",
            dead_zone=DEAD_ZONE, alpha_dead_zone=0.0, least_speed=_RESTING * self.top_speed,
            adapt_after_s=self.settle_s, freeze=True, screening=screening,
            rule=AlarmRule(CONSECUTIVE, settle_s=self.settle_s), velocity=Kalman(self.noise, self.jerk),
        )  # fmt: skip

    @cached_property
    def velocity(self) -> SteadyKalman:
        """The steady form of the velocity filter."""
        return SteadyKalman(self.noise, self.jerk, self.dt_s)

    @cached_property
    def compiled(self) -> Observer:
        """The same with the steady form of the velocity filter: for fleets, and to learn with."""
        return replace(self.observer, velocity=self.velocity)

    @cached_property
    def networks(self) -> tuple[HighOrder, HighOrder]:
        """S1 and S2 with a sigmoid from 0 to 1 over the speeds of the valve."""
        middle = 0.5 * self.top_speed
        first, second = (
            HighOrder(order, inputs, m=1.0, l=4.0 / middle, c=middle, lam=0.0)
            for order, inputs in ((ORDER1, 2), (ORDER2, 1))
        )
        return first, second

    @cached_property
    def bounds(self) -> Bounds:
        """The sets of the laws: a quarter of what Phi may grow for each of its terms, a third for each alpha."""
        raised = RAISED * self.least_phi / 4.0
        followed = FOLLOWED * self.least_phi / 3.0
        n1, n2 = (len(one.table().powers) for one in self.networks)
        return Bounds(
            raised / (self.top_speed * math.sqrt(n1)), raised / math.sqrt(n2), raised / self.top_speed, raised,
            followed / self.top_speed, followed / self.top_input, followed / self.top_position, about_start=True,
        )  # fmt: skip

    @property
    def least_phi(self) -> float:
        """Phi at rest, where it is least, as no learned weight is negative [span/s2]."""
        return self.b1

    def weight_gains(self, gain: float) -> tuple[float, float]:
        """Of the laws of w1 and e1, whose terms go with the speed, and of w2 and b1: alike at the top speed."""
        return gain / self.top_speed**2, gain

    @cached_property
    def _alpha_gains(self) -> tuple[float, float, float]:
        """Of the laws of alpha1, alpha4, alpha5."""
        if not self.adapts:
            return 0.0, 0.0, 0.0
        rate = (Observer.k2 + self.alpha1) / ADAPT_S
        return rate / self.top_speed**2, rate / self.top_input**2, rate / self.top_position**2

    @property
    def settle_s(self) -> float:
        """No alarm so long after a start or a gap [s]."""
        return max(SETTLE_S, SETTLE_SAMPLES * self.dt_s)

    def scaled(self, data: Measurements) -> tuple[Array, Array, Array]:
        """Time [s], position and input in the observer's units, each (n_samples,): what `Observer.run` takes."""
        position = (data.values["position"] - self.position_zero) / self.position_span
        return data.time_s, position, (data.values[self.input] - self.input_zero) / self.input_span

    def step(
        self, state: ObserverState, moment: Measurement, frozen: bool = False
    ) -> tuple[ObserverState, Decision]:  # fmt: skip
        """One step of the observer on a measurement. frozen : no law runs."""
        position = (moment.values["position"] - self.position_zero) / self.position_span
        u = (moment.values[self.input] - self.input_zero) / self.input_span
        after, decision = self.observer.step(state, moment.time_s, position, u)
        return after.with_estimates(state) if frozen else after, decision

    def residual(self, state: ObserverState, decision: Decision) -> float:
        """xi2 + Phi sigm(xi2) / k2 in m/s: what is left of the balance, with what Phi takes of it at speed given back.

        NaN while settling and where the sample was skipped. Not a share of rho: a fault that makes the stem fast would
        raise its own limit.
        """
        used = decision.verdict.used and state.core[kernel.SETTLED] >= self.settle_s
        if not used:
            return math.nan
        o = self.observer  # as `unbalanced`, in scalars: numpy takes ten times as long for one number
        return (decision.xi2 + decision.phi * min(max(decision.xi2 / o.delta, -1.0), 1.0) / o.k2) * abs(
            self.position_span
        )

    def unbalanced(self, xi2: Array, phi: Array) -> Array:
        """The residual [m/s] from xi2 and Phi, each (n_samples,)."""
        o = self.observer
        return np.asarray((xi2 + phi * np.clip(xi2 / o.delta, -1.0, 1.0) / o.k2) * abs(self.position_span))

    def residuals(self, data: Measurements) -> Array:
        """The residual [m/s] of a run (n_samples,); NaN while settling and where a sample was skipped."""
        decisions = self.observer.run(self.observer.initial(), *self.scaled(data))[1]
        return np.where(_used(decisions, self.settle_s), self.unbalanced(decisions.xi2, decisions.phi), np.nan)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> Calibration:
        """What `as_dict` gave."""
        return cls(**{**parts, "w1": tuple(parts["w1"]), "w2": tuple(parts["w2"])})


def _used(decisions: Decisions, settle_s: float) -> NDArray[np.bool_]:
    """Which samples count: used, and not within the settling time."""
    starts = np.isin(decisions.verdict, (SampleVerdict.START, SampleVerdict.GAP))
    restarted = np.maximum.accumulate(np.where(starts, decisions.time_s, -np.inf))
    return (decisions.verdict <= SampleVerdict.GAP) & (decisions.time_s - restarted >= settle_s)
