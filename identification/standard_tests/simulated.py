"""The standard tests run against a simulated valve behind its positioner."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from identification.standard_tests.procedure import KINDS, TestKind
from recordings import Array, BadParameter, Plant, Progress, Recording, Signal, silent
from simulator import BASE, CATALOGUE, Catalogue, kernel, positioned

RATE = 50.0
"""Samples a second [Hz]."""
NOISE = 1e-3
"""Standard deviation of the position's noise, % of the stroke."""
SUB_STEP = 2.5e-4
"""Longest sub-step of the simulation [s]."""
WAIT = 4.0
"""Time that a small step is held [s]."""


def _steps() -> Array:
    """Steps of 10 and 20 % of span in both directions, ten seconds each."""
    return np.repeat([50.0, 60.0, 50.0, 70.0, 50.0, 40.0, 50.0, 30.0, 50.0], round(10 * RATE))


def _small_steps() -> Array:
    """Steps of 0.2 % up until the stem has gone far, then down, then up again."""
    up = 50.0 + 0.2 * np.arange(16)
    return np.repeat([*up, *up[::-1], *up], round(WAIT * RATE))


def _sweep() -> Array:
    """From 5 to 95 % of span and back in two minutes, twice."""
    one = np.linspace(5.0, 95.0, round(60 * RATE))
    return np.concatenate([one, one[::-1], one, one[::-1]])


def _out_and_back() -> Array:
    """From 90 to 80 % of span and back."""
    return np.repeat([90.0, 80.0, 90.0], round(20 * RATE))


COURSES: Mapping[TestKind, Callable[[], Array]] = {
    "step": _steps, "deadband": _small_steps, "signature": _sweep, "partial-stroke": _out_and_back,
    "error-band": _sweep,
}  # fmt: skip
"""The set point [% of span] of every kind of test."""


def simulated_test(
    kind: TestKind,
    values: Mapping[str, float],
    stroke: float,
    *,
    effects: tuple[str, ...] = BASE,
    seed: int = 0,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Recording:
    """A recording of a standard test of a simulated valve behind a sampled PI positioner: set point, force, position.

    values : parameters by full name, SI units; stroke [m]; seed : of the noise. Raises BadParameter for a kind that
    there is not.
    """
    if kind not in KINDS:
        raise BadParameter("kind", kind, "there is no such test", f"use {', '.join(KINDS)}")
    progress("simulating", 0, 0)
    valve = kernel(effects, "force", catalogue)
    asked = COURSES[kind]()
    t = np.arange(len(asked)) / RATE
    force, position = positioned(
        valve, valve.vector(values), values, t, asked / 100 * stroke, stroke=stroke, start=asked[0] / 100 * stroke,
        h_max=SUB_STEP,
    )  # fmt: skip
    noise = np.random.default_rng([seed, 30]).normal(0.0, NOISE / 100 * stroke, len(t))
    signals = [
        Signal("time", t, "s", "time"),
        Signal("setpoint", asked, "%", "input", "set point of the positioner"),
        Signal("force", force, "N", "input", "net force of the actuator on the stem"),
        Signal("position", position + noise, "m", "output", "stem position"),
    ]
    return Recording.of(signals, plant=Plant(stroke_m=stroke), source="simulated", title=f"simulated {kind} test")
