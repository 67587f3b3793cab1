"""The two plants `bristle simulate` knows: a LuGre valve driven by a force, and the DAMADICS actuator in a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from recordings import BadInput, Recording
from simulator import Excitation, Sensors, ValveModel, random_valve, simulate
from simulator.damadics import Form, run_scenario

FORMS: dict[str, Form] = {"play": "play", "lugre": "lugre"}
"""Friction forms of the actuator by their word on the command line."""


def positive(option: str, value: float) -> float:
    """The value of an option that must be positive and finite. Raises BadInput."""
    if not 0 < value < float("inf"):
        raise BadInput(f"{option} {value:g}", "it is not a positive number", "give a positive number")
    return value


def valve(
    excite: str, model: str | None, changed: Mapping[str, float], stroke: float | None, sensors: Sensors, seed: int
) -> tuple[Recording, Mapping[str, Any]]:
    """A valve of a model file, or a seeded random one, with some parameters changed."""
    values, length = random_valve(seed)
    effects: tuple[str, ...] = ("inertia", "spring", "lugre")
    if model is not None:
        found = ValveModel.read(model)
        values, effects, length = found.values, found.effects, float(found.plant.get("stroke_m", length))
    unknown = sorted(set(changed) - set(values))
    if unknown:
        raise BadInput(f"--given {unknown[0]}", "no such parameter", f"there are {', '.join(values)}")
    positive("--rate", sensors.rate)
    chosen = positive("--stroke", stroke) if stroke is not None else length
    return simulate(
        values | dict(changed), Excitation.parse(excite), sensors, stroke=chosen, effects=effects, seed=seed
    )


def actuator(
    scenario: str, friction: str, noise: bool, seed: int, duration: float | None, sample: float | None
) -> tuple[Recording, Mapping[str, Any]]:
    """The DAMADICS actuator in a scenario of the benchmark."""
    if friction not in FORMS:
        raise BadInput(f"--friction {friction}", "there is no such form", f"there are {', '.join(FORMS)}")
    return run_scenario(scenario, FORMS[friction], noise, seed, duration=duration, sample=sample)
