"""What was commanded of a served actuator, as a value: carried out as a whole or refused as a whole."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from hil.plant.plant import Command
from recordings import BadInput
from simulator import CATALOGUE
from simulator.damadics import Fault, Form

INPUT_COMMANDS = {
    "setpoint": Command("1"),
    "upstream_pressure": Command("Pa"),
    "downstream_pressure": Command("Pa"),
    "temperature": Command("degC"),
    "supply_pressure": Command("Pa"),
}
"""In the order of the columns of a stimulus."""

FAULT_FIELDS = {
    "fault": "1",
    "fault_strength": "1",
    "fault_from": "s",
    "fault_development": "s",
    "fault_until": "s",
    "fault_direction": "1",
}
"""Fields of a fault and their units, in the order in which `Orders.ordered_fault` unpacks them."""

FRICTION = {f"lugre.{p.symbol}": p.unit for p in CATALOGUE["lugre"].parameters}
"""Friction parameters and their units."""

COMMANDS: Mapping[str, Command] = MappingProxyType(
    {
        **INPUT_COMMANDS,
        **{name: Command(unit, harmful=True) for name, unit in {**FAULT_FIELDS, **FRICTION}.items()},
        "noise": Command(),
        "lugre": Command(harmful=True),
        "hidden_effect": Command(harmful=True),
    }
)
"""Everything that can be told to a served actuator."""


@dataclass(frozen=True)
class Orders:
    """What was commanded, over what was set up: inputs by name, fields of a fault, friction by symbol, switches."""

    form: Form
    noise: bool
    hidden: bool
    inputs: Mapping[str, float] = field(default_factory=dict)
    fault: Mapping[str, float] = field(
        default_factory=lambda: dict.fromkeys(FAULT_FIELDS, 0.0) | {"fault_strength": 1.0}
    )
    friction: Mapping[str, float] = field(default_factory=dict)

    def changed(self, changes: Mapping[str, float]) -> Orders:
        """With some commands carried out."""
        form: Form = ("lugre" if changes["lugre"] else "play") if "lugre" in changes else self.form
        kept = self.friction if form == "lugre" else {}
        return replace(
            self,
            form=form,
            noise=bool(changes.get("noise", self.noise)),
            hidden=bool(changes.get("hidden_effect", self.hidden and form == "lugre")),
            inputs={**self.inputs, **{n: v for n, v in changes.items() if n in INPUT_COMMANDS}},
            fault={**self.fault, **{n: v for n, v in changes.items() if n in FAULT_FIELDS}},
            friction={**kept, **{n.split(".")[1]: v for n, v in changes.items() if n in FRICTION}},
        )

    def ordered_fault(self) -> tuple[Fault, ...]:
        """The commanded fault; none for number 0. Raises BadInput for one that cannot be."""
        number, strength, start, development, stop, direction = (self.fault[name] for name in FAULT_FIELDS)
        if number != int(number) or direction != int(direction):
            raise BadInput("fault", f"number {number:g}, direction {direction:g}", "both are whole numbers")
        if number == 0:
            return ()
        return (Fault(int(number), strength, start, development, stop or math.inf, int(direction) or None),)
