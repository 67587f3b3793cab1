"""From S and J of a loop to the friction of its valve in newtons.

On a spring-opposed stem without a positioner the controller output moves the force of the actuator, and the whole range
of it moves the stem over its stroke: S = 100 (fs + fc) / (K stroke) and J = 100 (fs - fc) / (K stroke), in % of OP.
With a positioner OP is a set point, its controller hides the stick band, and there is no such bridge.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from identification.loops.amounts import StictionAmount
from identification.standard_tests import Interval
from recordings import BadParameter, Plant

ITEMS: Mapping[str, str] = {"stroke": "m", "K": "N/m", "area": "m2", "span": "kPa"}
"""Valve data, and their units: stroke and spring rate, or area and the span of its pressure for OP from 0 to 100 %."""
WITHOUT_POSITIONER = "the forces hold for a spring-opposed stem without a positioner"


@dataclass(frozen=True)
class FrictionForces:
    """fs, fc : break-away and sliding friction [N]; full : force of the whole range of OP [N]."""

    fs: Interval
    fc: Interval
    full: float


def full_force(valve: Mapping[str, float]) -> float:
    """The force [N] that the whole range of OP makes, from valve data by the names of `ITEMS`.

    Raises BadParameter for data that are unknown, not positive, not enough, or contradict one another.

    >>> full_force({"stroke": 0.02, "K": 5e4})
    1000.0
    """
    for name, value in valve.items():
        if name not in ITEMS:
            raise BadParameter("valve", name, "it is not known of a valve", f"there are {', '.join(ITEMS)}")
        if not 0 < value < float("inf"):
            raise BadParameter("valve", f"{name}={value:g}", "it is not a positive number", f"give it in {ITEMS[name]}")
    spring = valve["K"] * valve["stroke"] if {"K", "stroke"} <= set(valve) else None
    air = valve["area"] * valve["span"] * 1e3 if {"area", "span"} <= set(valve) else None
    if spring is None and air is None:
        remedy = "give stroke=0.02,K=5e4 (m, N/m), or area=0.0129,span=80 (m2, kPa)"
        raise BadParameter("valve", ", ".join(valve), "it is not enough for forces", remedy)
    if spring is not None and air is not None and not 0.5 < air / spring < 2.0:
        found = f"K times stroke is {spring:.3g} N, and area times span {air:.3g} N"
        raise BadParameter("valve", ", ".join(valve), found, "check the units: m, N/m, m2, kPa")
    return float(air or spring or 0.0)


def known_of(plant: Plant) -> dict[str, float]:
    """The valve data that a recording has; empty where they are not enough."""
    if plant.stroke_m is None or plant.spring_constant_N_per_m is None:
        return {}
    return {"stroke": plant.stroke_m, "K": plant.spring_constant_N_per_m}


def friction_forces(amount: StictionAmount, full: float) -> FrictionForces:
    """The friction of a valve whose whole range of OP makes a force `full` [N]."""
    return FrictionForces(amount.total.scaled(full / 200), amount.rest.scaled(full / 200), full)
