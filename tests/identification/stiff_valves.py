"""Stiff valves as a plant records them: simulated at 1000 Hz, every so many samples kept, noise on both channels."""

from __future__ import annotations

import functools
from collections.abc import Mapping

import numpy as np

from recordings import Recording
from simulator import BASE, Excitation, Sensors, simulate

STIFF = {
    "mass.m": 2.0, "spring.K": 60900.0, "spring.F0": 580.0, "lugre.fc": 150.0, "lugre.fs": 200.0, "lugre.vs": 5e-3,
    "lugre.sigma0": 1e7, "lugre.sigma1": 3000.0, "lugre.sigma2": 500.0,
}  # fmt: skip
"""The mass swings on its bristles by 11 rad from sample to sample at 200 Hz."""
STEM_TEST = ("staircase:40", "sine:90")
STROKE, FINE = 0.04, 1000.0
POSITION_NOISE, FORCE_NOISE = 5e-6, 0.6


@functools.cache
def _exact(course: str, seed: int, changed: tuple[tuple[str, float], ...], effects: tuple[str, ...]) -> Recording:
    values = STIFF | dict(changed)
    return simulate(values, Excitation.parse(course), Sensors(FINE), stroke=STROKE, seed=seed, effects=effects)[0]


def stem_test(
    rate: float,
    courses: tuple[str, ...] = STEM_TEST,
    seed: int = 1,
    values: Mapping[str, float] | None = None,
    force_noise: float = FORCE_NOISE,
    effects: tuple[str, ...] = BASE,
) -> list[Recording]:
    """The recordings of some courses at a rate [Hz] that divides 1000; values : what is other than in `STIFF`;
    effects : of the valve."""
    rng, every, found = np.random.default_rng([seed, 7]), round(FINE / rate), []
    for i, course in enumerate(courses):
        exact = _exact(course, 10 * seed + i, tuple((values or {}).items()), effects)
        t, x, u = (exact[name].values[::every] for name in ("time", "position", "force"))
        x, u = x + POSITION_NOISE * rng.normal(size=len(t)), u + force_noise * rng.normal(size=len(t))
        found.append(Recording.from_arrays(time=t, position=x, force=u))
    return found
