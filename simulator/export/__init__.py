"""A valve model outside of this toolkit: C source, a CasADi function, a functional mock-up unit."""

from __future__ import annotations

from simulator.export.c_source import c_source, write_c
from simulator.export.casadi_step import casadi_step, write_casadi
from simulator.export.fmu import write_fmu
from simulator.export.step_parts import ExportedStep

__all__ = ["ExportedStep", "c_source", "casadi_step", "write_c", "write_casadi", "write_fmu"]
