"""A control loop from what historians keep, set point, process value and controller output: does its valve stick?"""

from identification.loops.assessment import Assessment
from identification.loops.loop import LOOP_KINDS, ControlLoop, LoopKind, loop_of
from identification.loops.procedure import assess_loop, loop_evidence
from identification.loops.reading import read_loop
from identification.loops.simulated import CAUSES, SimulatedLoop, compressed, simulated_loop

__all__ = [
    "CAUSES",
    "LOOP_KINDS",
    "Assessment",
    "ControlLoop",
    "LoopKind",
    "SimulatedLoop",
    "assess_loop",
    "compressed",
    "loop_evidence",
    "loop_of",
    "read_loop",
    "simulated_loop",
]
