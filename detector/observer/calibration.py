"""The observer set up for one valve: its scaling, parameters, velocity filter and threshold.

The parameters alpha are held, for adapted ones learn the fault away. The laws (4.20) run outside the relative dead zone
only and are bounded, so that Phi can follow a drift by a half and no further: the detector cannot go deaf.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from detector.measurements import Measurement, Measurements
from detector.observer import kernel
from detector.observer.alarm_rule import AlarmRule
from detector.observer.observer import Bounds, Observer, Start
from detector.observer.screening import SampleVerdict, Screening
from detector.observer.state import Decision, Decisions, ObserverState
from detector.observer.velocity import SteadyKalman
from recordings import Array

DEAD_ZONE, CONSECUTIVE = 0.8, 2
"""The laws adapt while the residual is above this share of rho; so many samples above rho in a row are an alarm."""

SETTLE_SAMPLES, SETTLE_S, GAP_SAMPLES = 30, 1.0, 5
_UNBOUNDED = 1e9


@dataclass(frozen=True)
class Calibration:
    """An observer in scaled units, x1 = (position - position_zero) / position_span and so for the input.

    input : the signal that stands for u; alpha1, alpha4, alpha5, b1 : of the observer [1/s, 1/s2, 1/s2, span/s2];
    noise : of x1 [span]; jerk : of the velocity filter [span2/s5]; dt_s : sampling time [s]; error : standard deviation
    of the model error [span/s2].
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

    @cached_property
    def velocity(self) -> SteadyKalman:
        """The velocity filter."""
        return SteadyKalman(self.noise, self.jerk, self.dt_s)

    @cached_property
    def observer(self) -> Observer:
        """The observer with everything that was learned."""
        most = 1.5 * self.b1
        screening = Screening(gap_s=max(GAP_SAMPLES * self.dt_s, 0.5), top_speed=max(20.0, 2.0 / self.dt_s))
        return Observer(
            start=Start(self.alpha1, self.alpha4, self.alpha5, b1=self.b1),
            bounds=Bounds(0.0, 0.0, 0.0, most, _UNBOUNDED, _UNBOUNDED, _UNBOUNDED),
            alpha_gain=0.0, sigm="sat", dead_zone=DEAD_ZONE, freeze=True, screening=screening,
            rule=AlarmRule(CONSECUTIVE, settle_s=self.settle_s), velocity=self.velocity,
        )  # fmt: skip

    @property
    def settle_s(self) -> float:
        """No alarm so long after a start or a gap [s]."""
        return max(SETTLE_S, SETTLE_SAMPLES * self.dt_s)

    def scaled(self, data: Measurements) -> tuple[Array, Array, Array]:
        """Time [s], position and input in the observer's units, each (n_samples,): what `Observer.run` takes."""
        position = (data.values["position"] - self.position_zero) / self.position_span
        return data.time_s, position, (data.values[self.input] - self.input_zero) / self.input_span

    def step(self, state: ObserverState, moment: Measurement) -> tuple[ObserverState, Decision]:
        """One step of the observer on a measurement."""
        position = (moment.values["position"] - self.position_zero) / self.position_span
        u = (moment.values[self.input] - self.input_zero) / self.input_span
        return self.observer.step(state, moment.time_s, position, u)

    def residual(self, state: ObserverState, decision: Decision) -> float:
        """xi2 in m/s; NaN while settling and where the sample was skipped."""
        used = decision.verdict.used and state.core[kernel.SETTLED] >= self.settle_s
        return decision.xi2 * abs(self.position_span) if used else math.nan

    def residuals(self, data: Measurements) -> Array:
        """xi2 [m/s] of a run (n_samples,); NaN while settling and where a sample was skipped."""
        decisions = self.observer.run(self.observer.initial(), *self.scaled(data))[1]
        return np.where(_used(decisions, self.settle_s), decisions.xi2 * abs(self.position_span), np.nan)

    def scores(self, data: Measurements) -> Array:
        """abs(xi2) / rho, the smaller one of two running; 0 while settling and where a sample was skipped."""
        return scores(self.observer.run(self.observer.initial(), *self.scaled(data))[1], self.settle_s)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> Calibration:
        """What `as_dict` gave."""
        return cls(**parts)


def scores(decisions: Decisions, settle_s: float) -> Array:
    """abs(xi2) / rho of a run, (n_samples,), the smaller one of two running; 0 where it does not count."""
    ratio = np.abs(decisions.xi2) / np.maximum(decisions.rho, 1e-300)
    ratio[~_used(decisions, settle_s)] = 0.0
    return np.minimum(ratio, np.concatenate([[0.0], ratio[:-1]]))


def _used(decisions: Decisions, settle_s: float) -> NDArray[np.bool_]:
    """Which samples count: used, and not within the settling time."""
    starts = np.isin(decisions.verdict, (SampleVerdict.START, SampleVerdict.GAP))
    restarted = np.maximum.accumulate(np.where(starts, decisions.time_s, -np.inf))
    return (decisions.verdict <= SampleVerdict.GAP) & (decisions.time_s - restarted >= settle_s)
