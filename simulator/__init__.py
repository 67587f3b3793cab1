"""What is the plant? Effects, the compiled physics, excitations and simulated recordings."""

from simulator._cache import artefact, machine
from simulator._effect import Catalogue, Effect, Memory, Parameter, Quantities, Site
from simulator._excitation import Excitation
from simulator._kernel import Causality, Kernel, kernel, shows_imposed
from simulator._native import native_module
from simulator._relaxation import Lag, Relaxation
from simulator._scan import Recurrence, Scan, Scanner
from simulator._simulate import Sensors, random_valve, simulate
from simulator._valve import FittedTo, Status, Value, ValveModel
from simulator.effects import BASE, CATALOGUE

__all__ = [
    "BASE",
    "CATALOGUE",
    "Catalogue",
    "Causality",
    "Effect",
    "Excitation",
    "FittedTo",
    "Kernel",
    "Lag",
    "Memory",
    "Parameter",
    "Quantities",
    "Recurrence",
    "Relaxation",
    "Scan",
    "Scanner",
    "Sensors",
    "Site",
    "Status",
    "Value",
    "ValveModel",
    "artefact",
    "kernel",
    "machine",
    "native_module",
    "random_valve",
    "shows_imposed",
    "simulate",
]
