"""Friction models of the source document, section 2.1, on plain numbers, with the fits that make them from data.

They serve studies and tests; what a kernel simulates and fits are the effects in `simulator.effects`.
"""

from simulator.friction.armstrong import Drive, SevenParameters, StickSlip, simulate_drive
from simulator.friction.dwell import ExponentialDwell, RationalDwell, fit_dwell
from simulator.friction.leuven import LeuvenFriction
from simulator.friction.maps import (
    AsymmetricMap,
    CanudasMap,
    CoulombMap,
    FrictionMap,
    MapFit,
    RootMap,
    StribeckMap,
    TangentialStiffness,
    fit_map,
)
from simulator.friction.tables import CAPABILITIES, TYPICAL_RANGES, Capability, TypicalRange

__all__ = [
    "CAPABILITIES",
    "TYPICAL_RANGES",
    "AsymmetricMap",
    "CanudasMap",
    "Capability",
    "CoulombMap",
    "Drive",
    "ExponentialDwell",
    "FrictionMap",
    "LeuvenFriction",
    "MapFit",
    "RationalDwell",
    "RootMap",
    "SevenParameters",
    "StickSlip",
    "StribeckMap",
    "TangentialStiffness",
    "TypicalRange",
    "fit_dwell",
    "fit_map",
    "simulate_drive",
]
