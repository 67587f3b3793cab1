"""Runs of the benchmark actuator as a detector sees them: six basic signals once a second, in blocks, never a whole day
of 2.5 ms steps in memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from recordings import Array, BadInput, Integers
from simulator.damadics import (
    CHANNELS,
    FAULTS,
    INPUTS,
    SPANS,
    STEP,
    Actuator,
    Fault,
    Form,
    Noise,
    Stimulus,
    measured,
    strengths,
)
from simulator.damadics.stimuli import step_one

SIGNALS = ("CV", "P1", "P2", "T1", "X", "F")
"""Columns of a run: the benchmark's basic measurements, each a share of its span; CV without noise."""

CV, P1, P2, T1, X, F = range(6)

RATES = (1, 10, 100, 400)
"""Sampling rates [Hz]; the samples of each second are averaged, at 1 Hz there is one."""

_PER_SECOND = round(1 / STEP)
_BLOCK_S = 100
_SPAN = np.array([SPANS[name] for name in SIGNALS])


@dataclass(frozen=True)
class Setting:
    """What a run is made of. form : of the friction; seed : of the noise; noise : factor on the benchmark's noise;
    stimulus : what the process does; begins_s : time of the stimulus at the start [s]; position : of the rod at the
    start [share of the stroke], its chamber empty.
    """

    form: Form = "play"
    seed: int = 0
    noise: float = 1.0
    stimulus: Stimulus = step_one
    begins_s: float = 0.0
    position: float = 0.0


def random_start(form: Form, seed: int) -> Setting:
    """A run that does not start as the benchmark's do: at another instant of the process, the rod somewhere."""
    rng = np.random.default_rng(seed)
    return Setting(form, seed, begins_s=float(rng.uniform(0.0, 10_000.0)), position=float(rng.uniform(0.0, 1.0)))


def simulate(
    faults: Sequence[Fault], duration_s: float, setting: Setting, rates: Sequence[int] = (1,)
) -> dict[int, Array]:
    """Signals once a second by sampling rate, each (n_seconds, 6), columns `SIGNALS`; row k is of second k to k + 1.

    A run that stops being finite is as long as it got. Raises BadInput for less than a second, or a rate that
    is not of `RATES`.
    """
    if duration_s < 1 or any(rate not in RATES for rate in rates):
        found = f"{duration_s:g} s at {', '.join(map(str, rates))} Hz"
        raise BadInput("simulated run", found, f"at least 1 s, at {', '.join(map(str, RATES))} Hz")
    actuator, noise, seconds = _actuator(setting.form), _noise(setting), int(duration_s)
    state, rows = actuator.start(setting.position), {rate: np.empty((seconds, len(SIGNALS))) for rate in rates}
    for first in range(0, seconds, _BLOCK_S):
        last = min(first + _BLOCK_S, seconds)
        steps = np.arange(first * _PER_SECOND, last * _PER_SECOND)
        inputs = np.empty((len(steps), len(INPUTS)))
        t = np.asarray(steps / _PER_SECOND, np.float64)
        inputs[:, :5], inputs[:, 5:] = setting.stimulus(t + setting.begins_s), strengths(faults, t)
        setpoint = inputs[:, 0].copy()
        inputs[:, 0] = np.clip(setpoint + noise.setpoint(steps), 0.0, 1.0)
        try:
            state, signals = actuator.advance(state, inputs)
        except BadInput:
            if first == 0:
                raise
            # The published chamber loses its air when a rod with wide play hunts (f4 beyond 0.7).
            return {rate: kept[:first] for rate, kept in rows.items()}
        for rate in rates:
            rows[rate][first:last] = _seconds(signals, setpoint, steps, noise, rate)
    return rows


def _seconds(signals: Array, setpoint: Array, steps: Integers, noise: Noise, rate: int) -> Array:
    """One row per second: the mean of the samples of that second."""
    stride = _PER_SECOND // rate
    keep = slice(0, None, stride)
    sent = measured(signals[keep].copy(), noise, steps[keep])
    columns = np.column_stack([setpoint[keep], *(sent[:, CHANNELS.index(name)] for name in SIGNALS[1:])])
    return columns.reshape(-1, rate, len(SIGNALS)).mean(axis=1)


def _noise(setting: Setting) -> Noise:
    usual = Noise(setting.seed)
    return Noise(setting.seed, usual.white * setting.noise, usual.hum * setting.noise)


@lru_cache(maxsize=4)
def _actuator(form: Form) -> Actuator:
    return Actuator(form)


def healthy(duration_s: float, setting: Setting, rates: Sequence[int] = (1,)) -> dict[int, Array]:
    """A run without a fault."""
    return simulate((), duration_s, setting, rates)


def with_fault(number: int, strength: float, setting: Setting, *, onset_s: float, grows_s: float, duration_s: float,
               rates: Sequence[int] = (1,)) -> dict[int, Array]:  # fmt: skip
    """A run in which one fault of the benchmark's direction grows from `onset_s` on."""
    fault = Fault(number, strength, start_s=onset_s, development_s=grows_s, direction=FAULTS[number].direction)
    return simulate((fault,), duration_s, setting, rates)
