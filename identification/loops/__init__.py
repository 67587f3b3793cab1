"""A control loop from what historians keep, set point, process value and controller output: does its valve stick?"""

from identification.loops.amounts import error_of
from identification.loops.assessment import Assessment
from identification.loops.calibration import CalibrationTable
from identification.loops.evidence import of_search
from identification.loops.forces import FrictionForces, known_of
from identification.loops.joint import process_gain
from identification.loops.loop import LOOP_KINDS, ControlLoop, LoopKind, loop_of
from identification.loops.procedure import LoopFindings, assess_loop, loop_findings, told_by_place
from identification.loops.reading import read_loop
from identification.loops.simulation.kept import HOW, as_kept, compressed, interpolated, quantised
from identification.loops.simulation.simulated import CAUSES, SimulatedLoop, simulated_loop
from identification.loops.simulation.stem import STROKE
from identification.loops.verdict import table_of, weighed_by

__all__ = [
    "CAUSES",
    "HOW",
    "LOOP_KINDS",
    "STROKE",
    "Assessment",
    "CalibrationTable",
    "ControlLoop",
    "FrictionForces",
    "LoopFindings",
    "LoopKind",
    "SimulatedLoop",
    "as_kept",
    "assess_loop",
    "compressed",
    "error_of",
    "interpolated",
    "known_of",
    "loop_findings",
    "loop_of",
    "of_search",
    "process_gain",
    "quantised",
    "read_loop",
    "simulated_loop",
    "table_of",
    "told_by_place",
    "weighed_by",
]
