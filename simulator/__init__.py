"""What is the plant? Effects, the compiled physics, excitations and simulated recordings."""

from simulator.compile.cache import artefact, machine
from simulator.compile.kernel import Causality, Kernel, kernel, shows_imposed
from simulator.compile.numba_loop import native_module
from simulator.compile.recurrence import Recurrence
from simulator.compile.scan import Run, Scan, Scanner
from simulator.effect import Catalogue, Effect, Memory, Parameter, Quantities, Site
from simulator.effects import BASE, CATALOGUE
from simulator.excitation import Excitation
from simulator.first_look import AddedForce, FirstLook, Missing
from simulator.imitation import usual_damping
from simulator.positioner import PERIOD, Positioner, positioned
from simulator.pulls import most_pulled, rhythms
from simulator.relaxation import Lag, Relaxation
from simulator.simulation import FINE_STEP, Sensors, random_valve, simulate
from simulator.valve_model import FittedTo, Status, Value, ValveModel

__all__ = [
    "BASE",
    "CATALOGUE",
    "FINE_STEP",
    "PERIOD",
    "AddedForce",
    "Catalogue",
    "Causality",
    "Effect",
    "Excitation",
    "FirstLook",
    "FittedTo",
    "Kernel",
    "Lag",
    "Memory",
    "Missing",
    "Parameter",
    "Positioner",
    "Quantities",
    "Recurrence",
    "Relaxation",
    "Run",
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
    "most_pulled",
    "native_module",
    "positioned",
    "random_valve",
    "rhythms",
    "shows_imposed",
    "simulate",
    "usual_damping",
]
