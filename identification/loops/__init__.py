"""A control loop from what historians keep, set point, process value and controller output: does its valve stick?"""

from identification.loops.assessment import Assessment
from identification.loops.evidence import of_search
from identification.loops.forces import FrictionForces, known_of
from identification.loops.loop import LOOP_KINDS, ControlLoop, LoopKind, loop_of
from identification.loops.procedure import assess_loop, loop_evidence
from identification.loops.reading import read_loop
from identification.loops.simulated import CAUSES, SimulatedLoop, as_kept, compressed, quantised, simulated_loop
from identification.loops.verdict import table_of

__all__ = [
    "CAUSES",
    "LOOP_KINDS",
    "Assessment",
    "ControlLoop",
    "FrictionForces",
    "LoopKind",
    "SimulatedLoop",
    "as_kept",
    "assess_loop",
    "compressed",
    "known_of",
    "loop_evidence",
    "loop_of",
    "of_search",
    "quantised",
    "read_loop",
    "simulated_loop",
    "table_of",
]
