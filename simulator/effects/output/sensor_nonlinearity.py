"""A position sensor whose scale is curved."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import AddedForce, FirstLook, Missing, travel

S_PEAK = math.sqrt(3) / 18
"""Largest value of s (1 - s) (1 - 2 s) on 0 <= s <= 1."""


class SensorNonlinearity(Effect):
    """y -> y + L (4 q s (1 - s) + c s (1 - s) (1 - 2 s) / 0.0962), s = y/L: right at both ends of the range L.

    q and c are the largest deviations of the arch and of the S, as shares of the range. L is where the sensor was
    calibrated, the stroke: to be held at a known value, for a change of L is nearly a change of the sensor's gain,
    which mass, spring and friction can take over.
    """

    id = "sensor_nonlinearity"
    site = Site.OUTPUT
    sentence = "the scale of the position sensor is curved between its calibrated ends"
    check = "the position feedback against a dial gauge at a quarter, half and three quarters of the stroke"
    parameters = (
        Parameter("q", "1", "largest deviation of the arch, share of the range", 0.01, -0.25, 0.25, 0.0),
        Parameter("c", "1", "largest deviation of the S, share of the range", 0.01, -0.09, 0.09, 0.0),
        Parameter("L", "m", "calibrated range, from x = 0: the stroke", 0.03, lower=0.0, positive=True, known="stroke"),
    )

    def output(self, q: Quantities, p: Values, s: Values) -> Expression:
        share = q.y / p["L"]
        bow = share * (1 - share)
        return q.y + p["L"] * bow * (4 * p["q"] + p["c"] / S_PEAK * (1 - 2 * share))

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The force by which the spring would move as far as the reading is off."""
        low, high = travel(recordings)
        stiff = -base["spring.K"] * (high - low)
        bow: AddedForce = lambda r: stiff * r.x / (high - low) * (1 - r.x / (high - low))  # noqa: E731
        forces: dict[str, AddedForce] = {
            "q": lambda r: 4 * bow(r), "c": lambda r: bow(r) / S_PEAK * (1 - 2 * r.x / (high - low))
        }  # fmt: skip
        return self.guessed(Missing.of(recordings, base).best([({}, forces)]))
