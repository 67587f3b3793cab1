"""Tables 2.1 and 2.2 of the source document as data: typical parameters, and what each part of friction predicts."""

from __future__ import annotations

from typing import NamedTuple


class TypicalRange(NamedTuple):
    """A row of Table 2.1. low, high in `unit`, which is per normal force F_n where it says so; None: very large."""

    symbol: str
    parameter: str
    low: float
    high: float | None
    unit: str
    depends_on: str


TYPICAL_RANGES = (
    TypicalRange("F_c", "coulomb", 0.001, 0.1, "F_n", "lubricant viscosity, contact geometry and loading"),
    TypicalRange("F_v", "viscous", 0.0, None, "N s/m", "lubricant viscosity, contact geometry and loading"),
    TypicalRange("F_s,inf", "stribeck", 0.0, 0.1, "F_n", "boundary lubrication, F_c"),
    TypicalRange("k_t", "stiffness", 1e-6, 50e-6, "(F_s + F_c)/m", "material properties and surface finish"),
    TypicalRange("v_s", "speed", 1e-5, 0.1, "m/s", "boundary lubrication, viscosity, contact geometry and loading"),
    TypicalRange("tau_L", "memory", 1e-3, 50e-3, "s", "lubricant viscosity, contact geometry and loading"),
    TypicalRange("gamma", "rise", 0.0, 200.0, "s", "boundary lubrication"),
)
"""Table 2.1. k_t is (F_s + F_c)/deflection, and its range is that of the deflection, 1 to 50 um. gamma reaches 200 s in
the paper the table is taken from (Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30(7), 1994); the document
prints 206."""


class Capability(NamedTuple):
    """A row of Table 2.2: a part of friction, and the behaviour that a model with it predicts."""

    part: str
    predicts: str


CAPABILITIES = (
    Capability("viscous", "stability at all velocities and at velocity reversals"),
    Capability("Coulomb", "no stick-slip for PD control, no hunting for PID control"),
    Capability("static + Coulomb + viscous", "stick-slip for certain initial conditions under PD, hunting under PID"),
    Capability("Stribeck", "needed to predict the initial conditions that lead to stick-slip"),
    Capability("rising static friction", "needed to predict the interaction of velocity and stick-slip amplitude"),
    Capability("frictional memory", "needed to predict the interaction of stiffness and stick-slip amplitude"),
    Capability("presliding", "needed to predict small displacements while sticking, and velocity reversals"),
)
"""Table 2.2. `tests/simulator/friction/test_armstrong.py` reproduces each row by simulation."""
