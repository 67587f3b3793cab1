"""The DAMADICS actuator in a scenario, as `bristle simulate` names it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bristle.door.plants import friction_form
from recordings import Recording
from simulator.damadics import run_scenario


def actuator(
    scenario: str, friction: str, noise: bool, seed: int, duration: float | None, sample: float | None
) -> tuple[Recording, Mapping[str, Any]]:
    """The DAMADICS actuator in a scenario of the benchmark."""
    return run_scenario(scenario, friction_form(friction), noise, seed, duration=duration, sample=sample)
