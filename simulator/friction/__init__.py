"""Friction models of the source document, section 2.1, on plain numbers, with the fits that make them from data.

They serve studies and tests; what a kernel simulates and fits are the effects in `simulator.effects`.
"""

from simulator.friction.alpha import (
    StribeckAlpha,
    functional,
    functional_basis,
    functional_both,
    functional_both_basis,
    functional_remainder,
    taylor,
    taylor_value,
)
from simulator.friction.alpha_network import AlphaNetwork, Bells
from simulator.friction.armstrong import Drive, SevenParameters, StickSlip, simulate_drive
from simulator.friction.dwell import ExponentialDwell, RationalDwell, fit_dwell
from simulator.friction.leuven import LeuvenFriction
from simulator.friction.lugre import LuGreParameters, ServoDesign, ServoRun, simulate_servo, strictly_positive_real
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
from simulator.friction.tanh_observer import ObservedFriction, TanhObserver, smoothed_friction

__all__ = [
    "CAPABILITIES",
    "TYPICAL_RANGES",
    "AlphaNetwork",
    "AsymmetricMap",
    "Bells",
    "CanudasMap",
    "Capability",
    "CoulombMap",
    "Drive",
    "ExponentialDwell",
    "FrictionMap",
    "LeuvenFriction",
    "LuGreParameters",
    "MapFit",
    "ObservedFriction",
    "RationalDwell",
    "RootMap",
    "ServoDesign",
    "ServoRun",
    "SevenParameters",
    "StickSlip",
    "StribeckAlpha",
    "StribeckMap",
    "TangentialStiffness",
    "TanhObserver",
    "TypicalRange",
    "fit_dwell",
    "fit_map",
    "functional",
    "functional_basis",
    "functional_both",
    "functional_both_basis",
    "functional_remainder",
    "simulate_drive",
    "simulate_servo",
    "smoothed_friction",
    "strictly_positive_real",
    "taylor",
    "taylor_value",
]
