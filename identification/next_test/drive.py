"""From a demand between 0 and 1 to the force that a valve gets, within the limits of the test."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.next_test.bounds import DesignBounds, DrivenBy
from identification.next_test.knowledge import DrivenTest, KnownValve
from recordings import Array, BadInput, BadParameter
from simulator import positioned


@dataclass(frozen=True)
class StemDrive:
    """How a demand drives a valve. drive : what is asked; low, high : what a demand of 0 and of 1 asks; slope : its
    fastest change in a second; all three in N, or in m for a set point.
    """

    valve: KnownValve
    drive: DrivenBy
    bounds: DesignBounds
    low: float
    high: float
    slope: float

    def asked(self, t: Array, demand: Array) -> Array:
        """What is asked (n_samples,), in N or in m: no faster than `slope`."""
        return _slewed(t, self.low + (self.high - self.low) * demand, self.slope)

    def test(self, t: Array, asked: Array, h_max: float) -> DrivenTest:
        """The force that the valve gets: what is asked, or what a positioner makes of a set point."""
        if self.drive != "setpoint":
            return DrivenTest(t, asked, False, h_max)
        valve = self.valve
        force, _ = positioned(
            valve.kernel, valve.p, valve.values, t, asked, stroke=valve.stroke, start=float(asked[0]), h_max=h_max
        )
        return DrivenTest(t, force, True, h_max)

    def shown(self, asked: Array) -> tuple[str, Array]:
        """What is asked as the sequence has it: a column's name with its unit, and its values."""
        if self.drive == "setpoint":
            return "setpoint_percent", 100 * asked / self.valve.stroke
        if self.drive == "pressure":
            return "pressure_kPa", asked / _area(self.valve) / 1e3
        return "force_N", asked

    def keeps(self, position: Array, valve: KnownValve) -> bool:
        """Whether a path [m] stays within the travel that is allowed, but for noise."""
        low, high = (share / 100 * valve.stroke for share in self.bounds.travel)
        slack = 3 * valve.noise + 0.005 * valve.stroke
        return bool(position.min() >= low - slack and position.max() <= high + slack)


def drive_of(valve: KnownValve, drive: DrivenBy, bounds: DesignBounds) -> StemDrive:
    """The drive of a valve within limits. Raises BadInput where the pressure does not move it within its travel."""
    low, high = (share / 100 * valve.stroke for share in bounds.travel)
    slope = bounds.rate / 100 * valve.stroke
    if drive == "setpoint":
        return StemDrive(valve, drive, bounds, low, high, slope)
    values = valve.values
    rate, preload, friction = values["spring.K"], values["spring.F0"], values["lugre.fc"]
    jump = max(0.0, values["lugre.fs"] - friction)  # a stem that breaks away goes so much too far
    ends = preload + rate * low - friction + jump, preload + rate * high + friction - jump
    if bounds.pressure is not None:
        area = _area(valve)
        ends = max(ends[0], bounds.pressure[0] * 1e3 * area), min(ends[1], bounds.pressure[1] * 1e3 * area)
    if ends[1] - ends[0] < 2 * friction:
        found = f"it leaves {max(0.0, ends[1] - ends[0]):.3g} N, and the friction is {friction:.3g} N"
        raise BadInput(f"{valve.name}: limits", found, "allow more travel or pressure: the stem would hardly move")
    return StemDrive(valve, drive, bounds, *ends, slope * rate)


def _area(valve: KnownValve) -> float:
    if valve.area is None:
        found = "the area of the diaphragm is not known"
        raise BadParameter("area", "", found, "give it in m2, as in 0.0129, to turn pressure into force")
    return valve.area


def _slewed(t: Array, wanted: Array, slope: float) -> Array:
    """A course that follows another no faster than so much in a second."""
    most = slope * np.diff(t, prepend=t[0])
    course, now = np.empty(len(t)), float(wanted[0])
    for i, (goal, step) in enumerate(zip(wanted.tolist(), most.tolist(), strict=True)):
        now += min(max(goal - now, -step), step)
        course[i] = now
    return course
