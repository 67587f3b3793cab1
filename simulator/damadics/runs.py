"""Scenarios as recordings: simulated block by block, so that a day of 2.5 ms steps needs little memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from recordings import BadInput, Progress, Recording, Truth, silent
from simulator.damadics import records
from simulator.damadics.actuator.actuator import Actuator, Form
from simulator.damadics.actuator.inputs import INPUTS
from simulator.damadics.actuator.parameters import Parameters
from simulator.damadics.faults import STEPS_PER_SECOND, strengths
from simulator.damadics.noise import Noise
from simulator.damadics.records import Samples
from simulator.damadics.scenarios import Scenario, scenario
from simulator.damadics.transmitters import measured
from simulator.effect import Catalogue
from simulator.effects import CATALOGUE

BLOCK = 20_000
"""Steps simulated at a time."""

MOST_SAMPLES = 5_000_000
"""A longer record is refused: it would not fit the memory of a small machine."""


def run_scenario(
    name: str,
    form: Form = "play",
    noise: bool | Noise = False,
    seed: int = 0,
    *,
    duration: float | None = None,
    sample: float | None = None,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    parameters: Parameters | None = None,
    doc_sign: bool = False,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> tuple[Recording, Truth]:
    """Simulate a scenario of `SCENARIOS`. Returns the recording and the truth behind it.

    noise : whether the benchmark's noise of this seed is on, or noise of your own; duration, sample [s] : the
    scenario's where not given, samples a multiple of 2.5 ms; form, effects, parameters, doc_sign : as in `Actuator`;
    catalogue : where the effects are looked up; progress : called with the steps that are done, and with all of them.

    Raises `BadInput` for an unknown scenario and for values that cannot be.

    >>> recording, truth = run_scenario("chapter5-f4", duration=3.0, sample=0.5)
    >>> recording.time[-1], recording["position"].unit, truth["scenario"]
    (np.float64(3.0), 'm', 'chapter5-f4')
    """
    actuator = Actuator(form, parameters or Parameters(), effects or {}, doc_sign, catalogue)
    chosen = Noise(seed) if noise is True else noise or None
    return run(scenario(name), actuator, chosen, duration=duration, sample=sample, progress=progress)


def run(
    what: Scenario,
    actuator: Actuator,
    noise: Noise | None = None,
    *,
    duration: float | None = None,
    sample: float | None = None,
    progress: Progress = silent,
) -> tuple[Recording, Truth]:
    """As `run_scenario`, for a scenario and an actuator of your own."""
    plan = _plan(what, duration, sample)
    blocks = []
    for first, block in _blocks(what, actuator, noise, plan):
        blocks.append(block)
        progress("simulation", min(first + BLOCK, plan.steps + 1), plan.steps + 1)
    samples = Samples.joined(blocks)
    return records.recording(what, actuator, noise, samples), records.truth(what, actuator, noise, samples)


@dataclass(frozen=True)
class _Plan:
    """The last step of a run, and every how many steps a sample is kept."""

    steps: int
    stride: int


def _plan(what: Scenario, duration: float | None, sample: float | None) -> _Plan:
    duration = what.thor if duration is None else duration
    sample = what.sample if sample is None else sample
    stride = sample * STEPS_PER_SECOND
    if not (np.isfinite(sample) and stride > 0.5 and abs(stride - round(stride)) < 1e-6 * stride):
        raise BadInput("sampling interval", f"it is {sample:g} s", "it is a multiple of the model's step, 0.0025 s")
    if not (np.isfinite(duration) and duration >= sample):
        raise BadInput("duration", f"it is {duration:g} s", f"it is at least one sampling interval, {sample:g} s")
    if duration / sample > MOST_SAMPLES:
        found = f"{duration:g} s sampled every {sample:g} s are {duration / sample:.3g} samples"
        raise BadInput("duration", found, f"at most {MOST_SAMPLES} are kept; sample less often or run shorter")
    return _Plan(round(duration * STEPS_PER_SECOND), round(stride))


def _blocks(what: Scenario, actuator: Actuator, noise: Noise | None, plan: _Plan) -> Iterator[tuple[int, Samples]]:
    """The first step and the samples of each block."""
    state = actuator.start()
    for first in range(0, plan.steps + 1, BLOCK):
        steps = np.arange(first, min(first + BLOCK, plan.steps + 1))
        t = steps / STEPS_PER_SECOND
        inputs = np.empty((len(steps), len(INPUTS)))
        inputs[:, :5], inputs[:, 5:] = what.stimulus(t), strengths(what.faults, t)
        setpoint = inputs[:, 0].copy()
        if noise is not None:
            inputs[:, 0] = np.clip(setpoint + noise.setpoint(steps), 0.0, 1.0)
        state, signals = actuator.advance(state, inputs)
        keep = slice(-first % plan.stride, None, plan.stride)
        # Copies: a view would keep the whole block in memory.
        kept, at = signals[keep].copy(), steps[keep].copy()
        yield first, Samples(at, setpoint[keep].copy(), kept, measured(kept, noise, at))
