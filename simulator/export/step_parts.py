"""What every form of an exported model is made of: the step of the simulation, with names that a program can have."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from recordings import BadInput
from simulator.compile.recurrence import Recurrence
from simulator.compile.step import VectorLayout, force_driven
from simulator.effect import Catalogue, Effect, Memory
from simulator.effects import CATALOGUE
from simulator.valve_model import ValveModel


@dataclass(frozen=True)
class ExportedParameter:
    """A parameter: its name in a program and in the model, what it is, and in words how well it is known."""

    name: str
    full_name: str
    value: float
    unit: str
    meaning: str
    known: str


@dataclass(frozen=True)
class ExportedState:
    """A state: its name in a program, its unit, what it is, and how it starts, as a word or a number."""

    name: str
    unit: str
    meaning: str
    start: str | float


@dataclass(frozen=True)
class ExportedStep:
    """The step of a model's simulation from force to position.

    model : the valve; catalogue : where its effects are looked up.
    """

    model: ValveModel
    catalogue: Catalogue = CATALOGUE

    @cached_property
    def effects(self) -> tuple[Effect, ...]:
        """The effects of the model, in the order of the catalogue. Raises BadInput where they make no simulation."""
        chosen = self.catalogue.pick(self.model.effects)
        if "inertia" not in self.model.effects:
            raise BadInput(
                "effects", "the model has no inertia", "export a model that simulates from force to position"
            )
        return chosen

    @cached_property
    def _assembled(self) -> tuple[Recurrence, VectorLayout]:
        return force_driven(self.effects)

    @property
    def recurrence(self) -> Recurrence:
        """The step as expressions, as `force_driven` gives it."""
        return self._assembled[0]

    @property
    def layout(self) -> VectorLayout:
        """What stands where in its vectors."""
        return self._assembled[1]

    @cached_property
    def functions(self) -> dict[str, ca.Function]:
        """The functions guess, residual, step and output."""
        return self.recurrence.functions(names=("guess", "residual", "step", "output"))

    @property
    def delay(self) -> str:
        """The name of the dead time in a program, empty where there is none."""
        return program_name(self.layout.delay)

    @property
    def parameters(self) -> tuple[ExportedParameter, ...]:
        """The parameters in the order of the recurrence."""
        declared = self.catalogue.parameters(effect.id for effect in self.effects)
        made = []
        for name in self.layout.parameters:
            value = self.model.parameters[name]
            known = value.status if value.std is None else f"{value.status}, standard deviation {value.std:.3g}"
            made.append(
                ExportedParameter(program_name(name), name, value.value, value.unit, declared[name].meaning, known)
            )
        return tuple(made)

    @property
    def states(self) -> tuple[ExportedState, ...]:
        """The states in the order of the recurrence."""
        owners = [(effect, memory) for effect in self.effects for memory in effect.memory]
        own = [
            ExportedState("x", "m", "position of the stem", "position"),
            ExportedState("v", "m/s", "velocity of the stem", "velocity"),
        ]
        rest = [
            ExportedState(program_name(name), memory.unit, f"memory of {effect.id}", _start(memory))
            for name, (effect, memory) in zip(self.layout.states[2:], owners, strict=True)
        ]
        return (*own, *rest)


def program_name(text: str) -> str:
    """A name as a program can have it: ``spring.K`` becomes ``spring_K``."""
    name = re.sub(r"\W", "_", text, flags=re.ASCII)
    return f"_{name}" if name[:1].isdigit() else name


def _start(memory: Memory) -> str | float:
    return "position" if memory.at_position else "force" if memory.at_force else memory.start
