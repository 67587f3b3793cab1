"""What acts on the actuator at every step: set point, pipe, supply, and the strengths of the 19 faults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from simulator.damadics.actuator.valve_flow import Fluid, fluid

INPUTS = ("CV", "P1", "P2", "T1", "Pz", *(f"f{number}" for number in range(1, 20)))
"""Columns of the inputs: set point [share of closing], inlet and outlet pressure [Pa], temperature [degC], supply
pressure [Pa, relative], and the signed strengths of the faults f1 to f19 [1]."""


@dataclass(frozen=True)
class Inputs:
    """The inputs as CasADi symbols; f is indexed by fault number, sense is the sign in which f12, f14, f19 act."""

    exo: Any
    sense: Any

    @classmethod
    def symbols(cls) -> Inputs:
        """Fresh symbols."""
        return cls(ca.SX.sym("e", 2 + len(INPUTS)), ca.SX.sym("sense"))

    @property
    def setpoint(self) -> Any:
        """CV."""
        return self.exo[2]

    @property
    def supply(self) -> Any:
        """Pz, ahead of f16."""
        return self.exo[6]

    @property
    def f(self) -> Any:
        """Strengths by fault number: ``f[4]``."""
        return self.exo[6:]

    def water(self) -> Fluid:
        """What flows, with the faults of the pipe."""
        return fluid(self.exo[3], self.exo[4], self.exo[5], self.f)
