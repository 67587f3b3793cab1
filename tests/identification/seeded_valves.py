"""Simulated recordings of seeded valves, and small changes to recordings, for the tests of the identification."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from identification import Experiment, Fit, Uncertainty, experiment, fit, uncertainty_of
from recordings import Plant, Recording, Signal
from simulator import BASE, Excitation, Sensors, kernel, random_valve, simulate

QUIET = 1e-4
"""Position noise of the seeded recordings, as a share of the stroke."""


@functools.cache
def recorded(seed: int, excite: str = "mixed:20", rate: float = 500.0, noise: float = QUIET) -> Recording:
    """A recording of the seeded random valve; the noise is a share of its stroke."""
    values, stroke = random_valve(seed)
    sensors = Sensors(rate=rate, position_noise=noise * stroke)
    return simulate(values, Excitation.parse(excite), sensors, stroke=stroke, seed=seed)[0]


@functools.cache
def fitted(seed: int, excite: str = "mixed:20", rate: float = 500.0) -> tuple[Experiment, Fit, Uncertainty]:
    """The fit to that recording, with nothing known beforehand."""
    prepared = experiment(recorded(seed, excite, rate))
    found = fit([prepared])
    return prepared, found, uncertainty_of(found)


def scores(found: Fit, known: Uncertainty, truth: dict[str, float]) -> dict[str, float]:
    """Errors in standard deviations, by parameter."""
    return {name: (found.values[name] - truth[name]) / known.spread[name] for name in known.names}


def floor_ratio(prepared: Experiment, found: Fit, true_noise: float) -> float:
    """Mean square residual over the variance of the noise that was really added."""
    return float((found.rms * prepared.noise_position / true_noise) ** 2)


def changed(recording: Recording, **values: np.ndarray) -> Recording:
    """The recording with the values of some signals replaced."""
    signals = [replace(s, values=values.get(name, s.values)) for name, s in recording.signals.items()]
    return Recording.of(signals, plant=recording.plant, title=recording.title)


def kept(recording: Recording, keep: np.ndarray) -> Recording:
    """The recording with only some of its samples."""
    signals = [replace(s, values=s.values[keep]) for s in recording.signals.values()]
    return Recording.of(signals, plant=recording.plant, title=recording.title)


def made(t: np.ndarray, force: np.ndarray, position: np.ndarray, **plant: float) -> Recording:
    """A force-driven recording of three arrays in SI units."""
    signals = [
        Signal("time", t, "s", "time"),
        Signal("force", force, "N", "input"),
        Signal("position", position, "m", "output"),
    ]
    return Recording.of(signals, plant=Plant(**plant), title="made")


def moved(
    values: dict[str, float], t: np.ndarray, force: np.ndarray, start: float = 0.0, *, hold: bool = False
) -> np.ndarray:
    """The position [m] of a valve under a force, without noise."""
    valve = kernel(BASE)
    return valve.run(t, force, valve.vector(values), valve.start(start), h_max=5e-5, hold=hold).outputs[:, 0]
