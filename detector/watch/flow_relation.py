"""The flow that belongs to an opening of the valve, and how far the measured flow is from it.

It tells apart two kinds of change that look alike in the balance of forces: with a wrong position sensor the flow does
not fit the opening any more, with a weak spring it does.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import pairwise
from math import isfinite, nan, sqrt
from typing import Any

import numpy as np

from detector.measurements import Measurement, Measurements
from recordings import Array

KNOTS = 7


@dataclass(frozen=True)
class FlowRelation:
    """The flow that belongs to an opening: `flow` over the root of the pressure drop where that is measured.

    flow : name of the signal; knots, heights (n_knots,) : position [m] and flow there; spread : standard deviation;
    drop : usual pressure drop [Pa], 0 where it is not measured; full : flow from which on the transmitter is blind.
    """

    flow: str
    knots: tuple[float, ...]
    heights: tuple[float, ...]
    spread: float
    drop: float
    full: float

    def departure(self, moment: Measurement) -> float:
        """How far the flow is from what belongs to the opening, in standard deviations; NaN where that is not known.

        A blind transmitter says that the flow is at least so large, which is too much where less belongs.
        """
        values = moment.values
        flow, x = values[self.flow], values["position"]
        if not (isfinite(flow) and self.knots[0] <= x <= self.knots[-1]):
            return nan
        blind = flow >= self.full
        flow = self._at_usual_drop(moment)
        away = (flow - _between(x, self.knots, self.heights)) / self.spread
        return max(away, 0.0) if blind else away

    def position_error(self, moment: Measurement) -> float:
        """How far the position is from the one that the flow belongs to [m]; NaN where the flow tells no position."""
        knots, rising = self._inverse
        if not rising or not moment.values[self.flow] < self.full:
            return nan
        flow = self._at_usual_drop(moment)
        if not rising[0] <= flow <= rising[-1]:
            return nan
        return moment.values["position"] - _between(flow, rising, knots)

    @cached_property
    def _inverse(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Knots and rising heights; none where a flow belongs to several positions."""
        turned = self.heights[-1] <= self.heights[0]
        knots, rising = (row[::-1] if turned else row for row in (self.knots, self.heights))
        return (knots, rising) if all(low < high for low, high in pairwise(rising)) else ((), ())

    def _at_usual_drop(self, moment: Measurement) -> float:
        """The flow as it would be at the usual pressure drop."""
        values = moment.values
        if not self.drop:
            return values[self.flow]
        drop = values["upstream_pressure"] - values["downstream_pressure"]
        return values[self.flow] / sqrt(max(drop / self.drop, 0.05))

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> FlowRelation:
        """What `as_dict` gave."""
        return cls(**{**parts, "knots": tuple(parts["knots"]), "heights": tuple(parts["heights"])})


def learned_flow(data: Measurements) -> tuple[FlowRelation, Array] | None:
    """The flow relation on fault-free data, and the departures (n_samples,) of each half of them from the relation of
    the other; None when there is no usable flow.
    """
    name = next((one for one in ("flow", "mass_flow") if one in data), None)
    if name is None:
        return None
    half = len(data) // 2
    whole, first, second = (_fitted(part, name) for part in (data, data[:half], data[half:]))
    if whole is None or first is None or second is None:
        return None
    away = [second.departure(moment) for moment in data[:half]] + [first.departure(moment) for moment in data[half:]]
    return whole, np.array(away)


def _between(x: float, knots: tuple[float, ...], heights: tuple[float, ...]) -> float:
    """Straight from knot to knot, for an x between the outer ones; numpy's takes ten times as long for one number."""
    i = min(max(bisect_right(knots, x) - 1, 0), len(knots) - 2)
    return heights[i] + (heights[i + 1] - heights[i]) * (x - knots[i]) / (knots[i + 1] - knots[i])


def _fitted(data: Measurements, name: str) -> FlowRelation | None:
    """Straight lines between knots along the learned stroke, by least squares."""
    flow, x = data.values[name], data.values["position"]
    drop, scaled = 0.0, flow
    if "upstream_pressure" in data and "downstream_pressure" in data:
        away = data.values["upstream_pressure"] - data.values["downstream_pressure"]
        drop = float(np.nanmedian(away))
        if drop > 0:
            scaled = flow / np.sqrt(np.maximum(away / drop, 0.05))
    top = float(np.nanmax(flow))
    full = top * 0.98 if np.nanmean(flow > 0.98 * top) > 0.1 else np.inf
    good = np.isfinite(scaled + x) & (flow < full)
    if np.sum(good) < 20 * KNOTS or not np.std(flow[good]) > 0:
        return None
    knots = np.unique(np.quantile(x[good], np.linspace(0.0, 1.0, KNOTS)))
    if len(knots) < 3:
        return None
    matrix = np.column_stack([np.interp(x[good], knots, row) for row in np.eye(len(knots))])
    heights, *_ = np.linalg.lstsq(matrix, scaled[good], rcond=None)
    spread = max(float(np.std(scaled[good] - matrix @ heights)), 0.005 * float(np.mean(np.abs(scaled[good]))), 1e-12)
    most = float(full) if np.isfinite(full) else 1e300
    return FlowRelation(name, tuple(knots.tolist()), tuple(heights.tolist()), spread, max(drop, 0.0), most)
