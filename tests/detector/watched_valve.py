"""A benchmark valve with friction as a force, moved to and fro, as the detector sees it, and the model it is given."""

from __future__ import annotations

import numpy as np

from detector import Measurements
from simulator import Value, ValveModel
from simulator.damadics import Actuator, Fault, Noise, Parameters, Scenario, run, stimuli

TENTH = 0.1
"""Sampling time [s]."""

_VALUES = {
    "mass.m": (2.0, "kg"), "spring.K": (1.0e5, "N/m"), "spring.F0": (2200.0, "N"), "lugre.fc": (116.0, "N"),
    "lugre.fs": (160.0, "N"), "lugre.vs": (1e-3, "m/s"), "lugre.sigma0": (3e6, "N/m"), "lugre.sigma1": (3.5e3, "N s/m"),
    "lugre.sigma2": (1500.0, "N s/m"),
}  # fmt: skip

MODEL = ValveModel(
    effects=("inertia", "spring", "lugre"),
    parameters={name: Value(value=value, unit=unit) for name, (value, unit) in _VALUES.items()},
    plant={"diaphragm_area_m2": 0.029, "stroke_m": 0.0381},
)
"""Not quite the plant's: the flow pushes on the plug too, which the detector has to find out."""


def moved(t: np.ndarray) -> np.ndarray:
    """Set point: two sines, so that the stem moves to and fro and never twice in the same way."""
    cv = 0.5 + 0.12 * np.sin(2 * np.pi * t / 14.0) + 0.08 * np.sin(2 * np.pi * t / 47.0)
    columns = stimuli.constant(0.5)(t)
    columns[:, 0] = cv
    return columns


def recorded(duration: float, *faults: Fault, seed: int = 1, sample: float = TENTH, stimulus=moved):
    """A recording of the valve with the benchmark's noise, from an empty chamber."""
    scenario = Scenario("moved", "to and fro", stimulus, duration, tuple(faults), sample)
    actuator = Actuator("lugre", Parameters(), {})
    return run(scenario, actuator, Noise(seed), duration=duration, sample=sample)[0]


def seen(duration: float, *faults: Fault, seed: int = 1, settle_s: float = 10.0) -> Measurements:
    """What the detector sees of it, without the first seconds in which the chamber fills."""
    data = Measurements.recorded(recorded(duration, *faults, seed=seed))
    return data[round(settle_s / TENTH) :]


def alarms(watch, data: Measurements, state=None):
    """All judgements at which an alarm began, ended or was renamed, and the state afterwards."""
    state = watch.initial() if state is None else state
    found = []
    for row in data:
        state, said = watch.step(state, row)
        if said.began or said.ended or said.renamed:
            found.append(said)
    return found, state
