"""The DAMADICS actuator in a scenario, as `bristle simulate` names it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from recordings import BadParameter, Recording
from simulator.damadics import Form, run_scenario

FORMS: dict[str, Form] = {"play": "play", "lugre": "lugre"}
"""Friction forms of the actuator by their word on the command line."""


def actuator(
    scenario: str, friction: str, noise: bool, seed: int, duration: float | None, sample: float | None
) -> tuple[Recording, Mapping[str, Any]]:
    """The DAMADICS actuator in a scenario of the benchmark."""
    if friction not in FORMS:
        raise BadParameter("friction", friction, "there is no such form", f"there are {', '.join(FORMS)}")
    return run_scenario(scenario, FORMS[friction], noise, seed, duration=duration, sample=sample)
