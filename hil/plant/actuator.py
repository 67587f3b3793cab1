"""The DAMADICS actuator as a served plant: its transmitters as signals, its inputs, faults and friction as commands."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from hil.plant.orders import COMMANDS, FRICTION, INPUT_COMMANDS, Orders
from recordings import Array, BadInput, Integers
from simulator import CATALOGUE, Catalogue
from simulator.damadics import (
    CHANNELS,
    COLUMN,
    INPUTS,
    SPANS,
    STEP,
    Actuator,
    Fault,
    Form,
    Noise,
    Parameters,
    Stimulus,
    measured,
    strengths,
)
from simulator.damadics.stimuli import constant

_MEASURED = {
    "upstream_pressure": ("P1", "Pa"),
    "downstream_pressure": ("P2", "Pa"),
    "temperature": ("T1", "degC"),
    "position": ("X", "m"),
    "mass_flow": ("F", "t/h"),
    "pressure": ("Ps", "Pa"),
    "drive": ("CVI", "1"),
    "supply_pressure": ("Pz", "Pa"),
}
"""Transmitters by the name of their signal: the benchmark's channel and our unit."""

_UNITS = {name: unit for name, (_, unit) in _MEASURED.items()}


@dataclass(frozen=True)
class ActuatorSetup:
    """What a served actuator is when it starts.

    form : friction as play or as a force; stimulus : what the process does; inputs : what of it does not follow the
    stimulus but has a value of its own, as commanded; faults : occur whatever is commanded; noise : the benchmark's;
    seed : of the noise; parameters : of the actuator; friction : LuGre parameters by symbol, where they deviate;
    hidden : effects of the catalogue, by id and symbol, that nobody is told of, and hidden_on : whether they act from
    the start; catalogue : where effects are looked up; made_by : what runs it, `Actuator` or a class that does so in
    another way. Friction and effects need the form ``lugre``.
    """

    form: Form = "play"
    stimulus: Stimulus = field(default_factory=lambda: constant(0.5))
    inputs: Mapping[str, float] = field(default_factory=dict)
    faults: tuple[Fault, ...] = ()
    noise: bool = False
    seed: int = 0
    parameters: Parameters = field(default_factory=Parameters)
    friction: Mapping[str, float] = field(default_factory=dict)
    hidden: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    hidden_on: bool = True
    catalogue: Catalogue = CATALOGUE
    made_by: type[Actuator] = Actuator


class ActuatorPlant:
    """A valve with its positioner in steps of 2.5 ms; satisfies `ServedPlant`.

    Commands: the five inputs (which then leave the stimulus), ``fault`` (number, 0 none) with its strength, times and
    direction (0: the benchmark's), ``noise``, ``lugre`` (1: friction as a force, 0: play; changing it restarts the
    plant), ``lugre.fc`` and the other friction parameters, and ``hidden_effect`` (0 or 1).
    Raises BadInput for a setup that cannot be.
    """

    step_s = STEP
    units = MappingProxyType(
        {"setpoint": "1", **_UNITS, "flow": "m3/h", "plant_time": "s", "fault_active": "1"},
    )
    commands = COMMANDS
    inputs = tuple(INPUT_COMMANDS)
    friction = tuple(FRICTION)
    """Names of the commands that set an input, and of those that set a parameter of the friction."""

    def __init__(self, setup: ActuatorSetup) -> None:
        self._setup = setup
        self._noise = Noise(setup.seed)
        self._injected: tuple[Fault, ...] = ()
        self._orders = Orders(setup.form, setup.noise, bool(setup.hidden) and setup.hidden_on, dict(setup.inputs))
        self._actuator, self._faults = self._built(self._orders)
        self._now: dict[str, float] = {}
        self.reset()

    def signals(self) -> Mapping[str, float]:
        """The transmitters now, in `units`."""
        return self._now

    def settings(self) -> Mapping[str, float]:
        """What every command is set to."""
        o, values = self._orders, self._actuator.values
        friction = {name: values.get(name, math.nan) for name in FRICTION}
        switches = {"noise": o.noise, "lugre": o.form == "lugre", "hidden_effect": o.hidden}
        inputs = {**dict(zip(INPUT_COMMANDS, self._inputs_now, strict=True)), **o.inputs}
        return {**inputs, **o.fault, **friction, **{name: float(on) for name, on in switches.items()}}

    def apply(self, changes: Mapping[str, float]) -> None:
        """Carry out commands, all or none. Raises BadInput for a value that cannot be."""
        orders = self._orders.changed(changes)
        self._actuator, self._faults = self._built(orders)
        restart = orders.form != self._orders.form
        self._orders = orders
        if restart:
            self.reset()

    @property
    def setup(self) -> ActuatorSetup:
        """What it was when it started."""
        return self._setup

    def inject(self, *faults: Fault) -> None:
        """Let further faults happen, on top of all others; without any, take back those that were injected before."""
        self._injected = (*self._injected, *faults) if faults else ()
        self._actuator, self._faults = self._built(self._orders)

    def reset(self) -> None:
        """At rest and open, with an empty chamber, at time 0."""
        self._state, self._step = self._actuator.start(), -1
        self.advance(1)

    def advance(self, n_steps: int) -> Mapping[str, Array]:
        """The next n_steps samples; sample k is what the transmitters show at step k, under the inputs of step k."""
        steps = np.arange(self._step + 1, self._step + 1 + n_steps)
        inputs = self._inputs(steps)
        setpoint = inputs[:, 0].copy()
        noise = self._noise if self._orders.noise else None
        if noise is not None:
            inputs[:, 0] = np.clip(setpoint + noise.setpoint(steps), 0.0, 1.0)
        self._state, signals = self._actuator.advance(self._state, inputs)
        self._step += n_steps
        self._inputs_now = (setpoint[-1], *inputs[-1, 1 : len(INPUT_COMMANDS)])
        samples = self._samples(signals, noise, steps, setpoint)
        samples["fault_active"] = np.any(inputs[:, len(INPUT_COMMANDS) :] != 0.0, axis=1).astype(float)
        self._now = {name: float(values[-1]) for name, values in samples.items()}
        return samples

    def _built(self, orders: Orders) -> tuple[Actuator, tuple[Fault, ...]]:
        """The actuator and the faults that setup and commands make together; play has no room for effects."""
        setup, friction = self._setup, orders.friction
        effects: dict[str, Mapping[str, float]] = {}
        if orders.form == setup.form or orders.form == "lugre":
            effects = {effect: self._hidden(effect, orders.hidden) for effect in setup.hidden}
            friction = {**setup.friction, **friction}
        if orders.hidden and not effects:
            remedy = "set the plant up with an effect, and with friction as a force"
            raise BadInput("hidden_effect", "there is none to switch on", remedy, parameter="effects")
        if friction:
            effects["lugre"] = friction
        actuator = setup.made_by(orders.form, setup.parameters, effects, catalogue=setup.catalogue)
        return actuator, (*setup.faults, *self._injected, *orders.ordered_fault())

    def _hidden(self, effect: str, on: bool) -> Mapping[str, float]:
        """Values of a hidden effect; while it is off, those that change nothing."""
        catalogue = self._setup.catalogue
        if on or effect not in catalogue:
            return self._setup.hidden[effect]
        parameters = catalogue[effect].parameters
        neutral = {p.symbol: p.neutral for p in parameters if p.neutral is not None}
        return {**self._setup.hidden[effect], **neutral}

    def _inputs(self, steps: Integers) -> Array:
        """Rows of the actuator's inputs, shape (n_steps, 24)."""
        t = _times(steps)
        inputs = np.empty((len(steps), len(INPUTS)))
        inputs[:, : len(INPUT_COMMANDS)] = self._setup.stimulus(t)
        for column, name in enumerate(INPUT_COMMANDS):
            if name in self._orders.inputs:
                inputs[:, column] = self._orders.inputs[name]
        inputs[:, len(INPUT_COMMANDS) :] = strengths(self._faults, t)
        return inputs

    def _samples(self, signals: Array, noise: Noise | None, steps: Integers, setpoint: Array) -> dict[str, Array]:
        shares = measured(signals, noise, steps)
        stroke = self._setup.parameters.stroke
        samples = {"setpoint": setpoint, "plant_time": _times(steps)}
        for name, (channel, _) in _MEASURED.items():
            span = {"X": stroke, "CVI": 1.0}.get(channel, SPANS[channel])
            samples[name] = shares[:, CHANNELS.index(channel)] * span
        samples["flow"] = 1000.0 * samples["mass_flow"] / signals[:, COLUMN["density"]]
        return samples


def _times(steps: Integers) -> Array:
    """Times of steps [s], the same numbers as the simulator has: a fault starts at the same step."""
    return np.asarray(steps / round(1 / STEP), np.float64)
