"""The numbers of the actuator: the published DABLib v1.22 values, and what may be changed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass, fields, replace
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from recordings import Array, BadInput

STEP = 0.0025
"""The fixed step of the benchmark model [s]."""


@dataclass(frozen=True)
class Parameters:
    """The actuator's constants in SI units; the defaults are those of the block diagram of DABLib v1.22.

    The library is tuned to actuator 3 of the sugar factory (boiler feed water, DN50), yet its supply pressure, bench
    set and controller gain are not the plant's: these are the values that reproduce published simulations.

    Raises `BadInput` for a constant that is not finite and positive (zero is allowed where it means "absent").

    >>> default = Parameters()
    >>> round(default.spring_rate * default.preload_travel / default.diaphragm_area)  # lower end of the bench set [Pa]
    20000
    """

    stroke: float = 0.0381
    """H0: travel of the rod from open to closed [m]."""
    mass: float = 2.0
    """m: stem, plug and diaphragm plate [kg]."""
    gravity: float = 9.81
    """g [m/s2]; the weight closes."""
    spring_rate: float = 60892.0
    """k = ks + kd: spring and diaphragm [N/m]."""
    preload_travel: float = 0.009525
    """x0: initial compression of the spring [m]."""
    viscous: float = 1500.0
    """b: viscous friction of the published form [N s/m]."""
    diaphragm_area: float = 0.029
    """Ae [m2]."""
    rod_play: float = 0.01
    """Db0: width of the play that stands for friction in the published form [share of the stroke]."""
    dead_volume: float = 0.0055
    """V0: chamber volume with the valve open [m3]."""
    gas_constant: float = 287.0
    """R [J/(kg K)]."""
    gas_temperature: float = 293.0
    """T0: temperature of the air in the chamber [K]."""
    atmosphere: float = 101325.0
    """p_atm [Pa]."""
    polytropic: float = 1.0
    """n: exponent of the chamber, 1 is isothermal [1]."""
    conductance: float = 2.5e-6
    """Cm: pneumatic conductance of the transducer [kg/(s Pa^0.5)]."""
    leak_conductance: float = 2e-7
    """Conductance of a full leak of the housing or diaphragm [kg/(s Pa^0.5)]."""
    supply_minimum: float = 120e3
    """The positioner treats a lower supply pressure as none [Pa, relative]."""
    gain: float = 100.0
    """kp of the positioner [1]; the plant's positioners have 40."""
    filter_time: float = 0.3
    """Tf: time constant of each of the two set-point filters [s]."""
    hold_steps: float = 14.0
    """The positioner's sample-and-hold in steps of 2.5 ms: 35 ms."""
    flow_gain: float = 120.0
    """Kvs of the open valve [m3/h-type, see `valve_flow`]."""
    bypass_gain: float = 19.75
    """Kvs of the open bypass [m3/h-type]."""
    plug_diameter: float = 0.05
    """Diameter of the plug on which the vena-contracta pressure acts [m]."""

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            smallest = 0.0 if name in _MAY_BE_ZERO else math.ulp(0.0)
            if not (math.isfinite(value) and value >= smallest):
                allowed = "finite and not negative" if name in _MAY_BE_ZERO else "finite and positive"
                raise BadInput(f"actuator parameter {name}", f"the value is {value:g}", f"it is {allowed}")
        if self.hold_steps != int(self.hold_steps):
            found = f"the value is {self.hold_steps:g}"
            raise BadInput("actuator parameter hold_steps", found, "it is a whole number of steps of 2.5 ms")

    @property
    def preload(self) -> float:
        """Force of the spring with the valve open [N]."""
        return self.spring_rate * self.preload_travel

    def vector(self) -> Array:
        """The values in the order of `symbols`."""
        return np.array(astuple(self), float)

    @classmethod
    def with_changes(cls, changes: Mapping[str, float]) -> Parameters:
        """The default values but for some, by name. Raises `BadInput` for a name that does not exist."""
        known = [item.name for item in fields(cls)]
        for name in changes:
            if name not in known:
                raise BadInput("actuator parameters", f"there is no '{name}'", f"there are {', '.join(known)}")
        return replace(cls(), **{name: float(value) for name, value in changes.items()})


_MAY_BE_ZERO = {"gravity", "preload_travel", "viscous", "rod_play", "leak_conductance", "supply_minimum", "bypass_gain"}


def symbols() -> tuple[Any, list[Any]]:
    """One CasADi symbol per parameter: as attributes of their names, and in the order of `Parameters.vector`."""
    names = [item.name for item in fields(Parameters)]
    values = [ca.SX.sym(name) for name in names]
    return SimpleNamespace(**dict(zip(names, values, strict=True))), values
