"""The simulated actuator that is served, from a scenario's name and plain values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields

from hil import ActuatorPlant, ActuatorSetup
from recordings import BadParameter
from simulator import BASE, CATALOGUE, Catalogue
from simulator.damadics import FORMS, Fault, Form, Parameters, Stimulus, scenario
from simulator.damadics.stimuli import constant

EffectSizes = Mapping[str, Mapping[str, float]]
"""Effects by id, with the values that are not of typical size, by symbol."""


def actuator(
    name: str | None,
    friction: str,
    faults: Iterable[Fault],
    settings: Mapping[str, float],
    effects: EffectSizes,
    *,
    stimulus: Stimulus | None = None,
    effects_on: bool = True,
    catalogue: Catalogue = CATALOGUE,
    noise: bool = False,
    seed: int = 0,
) -> ActuatorPlant:
    """The plant of `serve`, at the start of a scenario or with a constant set point. Raises BadInput."""
    for effect in effects:
        if effect in BASE:
            found = "it belongs to every actuator"
            raise BadParameter("effects", effect, found, "change it by settings: lugre.fc, spring_rate, mass")
    course, own = _course(name)
    rest = dict(settings)
    of_friction = {item.split(".")[1]: rest.pop(item) for item in ActuatorPlant.friction if item in rest}
    inputs = {item: rest.pop(item) for item in ActuatorPlant.inputs if item in rest}
    setup = ActuatorSetup(
        form=friction_form(friction), stimulus=stimulus or course, inputs=inputs, faults=(*own, *faults), noise=noise,
        seed=seed, parameters=_parameters(rest), friction=of_friction, hidden=effects, hidden_on=effects_on,
        catalogue=catalogue,
    )  # fmt: skip
    return ActuatorPlant(setup)


def _course(name: str | None) -> tuple[Stimulus, tuple[Fault, ...]]:
    """What the process does, and the faults of a scenario."""
    if name is None:
        return constant(0.5), ()
    chosen = scenario(name)
    return chosen.stimulus, chosen.faults


def friction_form(friction: str) -> Form:
    """The friction form of the actuator by its word. Raises BadParameter."""
    for form in FORMS:
        if form == friction:
            return form
    raise BadParameter("friction", friction, "there is no such friction", f"use {' or '.join(FORMS)}")


def _parameters(values: Mapping[str, float]) -> Parameters:
    known = {item.name for item in fields(Parameters)}
    for name in values:
        if name not in known:
            names = ", ".join((*ActuatorPlant.inputs, *ActuatorPlant.friction, *sorted(known)))
            raise BadParameter("settings", name, f"there is no setting {name!r}", f"there are {names}")
    return Parameters.with_changes(values)
