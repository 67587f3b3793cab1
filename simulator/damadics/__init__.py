"""The DAMADICS benchmark actuator: positioner, servomotor and control valve with 19 faults and 44 scenarios.

>>> from simulator.damadics import SCENARIOS, run_scenario
>>> sum(scenario.benchmark for scenario in SCENARIOS.values())
44
>>> recording, truth = run_scenario("f11-abrupt-big", noise=True, seed=1, duration=10.0)
>>> len(recording), "position" in recording
(11, True)
"""

from simulator.damadics.actuator.actuator import COLUMN, FORMS, Actuator, Form, State
from simulator.damadics.actuator.inputs import INPUTS
from simulator.damadics.actuator.outputs import SIGNALS
from simulator.damadics.actuator.parameters import STEP, Parameters
from simulator.damadics.faults import FAULTS, LEVELS, Fault, FaultKind, limited, strengths
from simulator.damadics.noise import CHANNELS, Noise
from simulator.damadics.records import HIDDEN
from simulator.damadics.runs import run, run_scenario
from simulator.damadics.scenarios import SCENARIOS, Scenario, scenario
from simulator.damadics.stimuli import Stimulus
from simulator.damadics.transmitters import SPANS, measured

__all__ = [
    "CHANNELS",
    "COLUMN",
    "FAULTS",
    "FORMS",
    "HIDDEN",
    "INPUTS",
    "LEVELS",
    "SCENARIOS",
    "SIGNALS",
    "SPANS",
    "STEP",
    "Actuator",
    "Fault",
    "FaultKind",
    "Form",
    "Noise",
    "Parameters",
    "Scenario",
    "State",
    "Stimulus",
    "limited",
    "measured",
    "run",
    "run_scenario",
    "scenario",
    "strengths",
]
