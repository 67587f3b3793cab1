"""The actuator, step by step: a state and inputs in, the next state and signals out."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from recordings import Array, BadInput
from simulator.compile.c_compiler import compiler
from simulator.compile.scan import Scanner
from simulator.damadics.actuator import force_form, past, play_form, servomotor
from simulator.damadics.actuator.inputs import INPUTS
from simulator.damadics.actuator.outputs import SIGNALS
from simulator.damadics.actuator.parameters import Parameters
from simulator.damadics.faults import FAULTS, STEPS_PER_SECOND, limited
from simulator.damadics.nearest_names import nearest
from simulator.effect import Catalogue, Effect, Memory
from simulator.effects import BASE, CATALOGUE

Form = Literal["play", "lugre"]
FORMS: tuple[Form, ...] = get_args(Form)

COLUMN: Mapping[str, int] = {name: number for number, name in enumerate(SIGNALS)}
"""Where each signal stands in the columns that `Actuator.advance` returns."""

_LONGEST_SUBSTEP = 1.1 * force_form.SUBSTEP
"""A little more than a sub-step, so that rounding of the time never adds one."""


@dataclass(frozen=True, eq=False)
class State:
    """Where an actuator is: steps of 2.5 ms since its start, and internal states, read-only, (n_states,), by name."""

    step: int
    values: Array
    names: tuple[str, ...]

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self.step / STEPS_PER_SECOND


@dataclass(frozen=True)
class Actuator:
    """One valve with its positioner.

    form : ``play``, the published model, or ``lugre``, with friction as a force; parameters : constants of the
    actuator; effects : for the form ``lugre``, values of effects of the catalogue by id and symbol: of the base effects
    what deviates from the default, of any other effect what deviates from its typical size; doc_sign : whether f12,
    f14 and f19 act in the sense of the benchmark's text (negative strengths lower the signal) instead of the library's;
    catalogue : where effects are looked up; `CATALOGUE.extended` makes one with effects of your own.

    Raises `BadInput` for an unknown form, effect or symbol, a value out of bounds, or effects with the form ``play``.

    >>> valve = Actuator()
    >>> inputs = np.zeros((400, len(INPUTS)))
    >>> inputs[:, :5] = 0.5, 3.5e6, 2.6e6, 20.0, 600e3
    >>> state, signals = valve.advance(valve.start(), inputs)
    >>> state.time, float(signals[0, COLUMN["F"]].round(1))
    (1.0, 360.0)
    """

    form: Form = "play"
    parameters: Parameters = field(default_factory=Parameters)
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    doc_sign: bool = False
    catalogue: Catalogue = CATALOGUE

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise BadInput("actuator", f"there is no friction form '{self.form}'", nearest(self.form, FORMS))
        if self.form == "play" and self.effects:
            found = f"the effect '{next(iter(self.effects))}' is asked for with the form 'play'"
            raise BadInput("actuator", found, "effects of the catalogue need the form 'lugre'")
        for effect, values in self.effects.items():
            _check_effect(self.catalogue, effect, values)
        object.__setattr__(self, "effects", {effect: dict(values) for effect, values in self.effects.items()})

    def __reduce__(self) -> tuple[type[Actuator], tuple[Any, ...]]:
        """Copy and send to other processes by what it was made from: the compiled form stays where it is."""
        return type(self), (self.form, self.parameters, self.effects, self.doc_sign, self.catalogue)

    @property
    def values(self) -> dict[str, float]:
        """Parameters of the effects by full name, as ``lugre.fc``; none in the form ``play``."""
        return {} if self.form == "play" else _effect_values(self)

    def start(self, position: float = 0.0) -> State:
        """At rest at a position [share of the stroke, 0 open] with an empty chamber, the positioner's filter at 0.

        Raises `BadInput` for a position outside 0 to 1.
        """
        if not 0 <= position <= 1:
            raise BadInput("actuator", f"the start position is {position:g}", "it is a share of the stroke, 0 to 1")
        compiled = self._compiled
        x = position * self.parameters.stroke
        first = compiled.first(self.parameters, x)
        values = np.array([first.get(name, 0.0) for name in compiled.states], float)
        return State(0, _frozen(values), compiled.states)

    def advance(self, state: State, inputs: Array) -> tuple[State, Array]:
        """Advance by n steps of 2.5 ms.

        inputs (n, 24), columns `INPUTS`; they hold over their step; fault strengths are limited to their range.
        Returns the state after the steps and the signals at the start of each, shape (n, n_signals), columns `SIGNALS`
        (see `COLUMN`). The same steps in blocks of any size give the same numbers.
        Raises `BadInput` for inputs of another shape or not finite.
        """
        final, signals = self._run(state, _checked(inputs, 1))
        return State(state.step + len(signals) - 1, _frozen(final), state.names), signals[:-1]

    def observe(self, state: State, inputs: Array) -> Array:
        """The signals at a state under inputs (24,), shape (n_signals,); nothing moves."""
        return self._run(state, _checked(np.atleast_2d(inputs)[:1], 0))[1][0]

    def _run(self, state: State, u: Array) -> tuple[Array, Array]:
        compiled = self._compiled
        if state.names != compiled.states:
            found = f"it is that of another actuator: {', '.join(state.names)}"
            raise BadInput("actuator state", found, "go on with an actuator of the same form and effects")
        t = np.arange(state.step, state.step + len(u)) / STEPS_PER_SECOND
        scan = compiled.scanner.run(
            t, u, self._vector, state.values, h_max=_LONGEST_SUBSTEP if compiled.substeps else 0.0, hold=True
        )
        if scan.failed is not None:
            found = f"at {t[scan.failed]:g} s the simulation is not finite"
            raise BadInput("actuator", found, "check its parameters, its effects and its inputs")
        return scan.final, scan.outputs

    @functools.cached_property
    def chosen(self) -> tuple[Effect, ...]:
        """The effects that make up the stem, in the order of the catalogue; none in the form ``play``."""
        return () if self.form == "play" else self.catalogue.pick((*BASE, *self.effects))

    @functools.cached_property
    def _compiled(self) -> _CompiledForm:
        return _built(self.form, self.chosen, compiler())

    @functools.cached_property
    def _vector(self) -> Array:
        compiled, values = self._compiled, self.values
        ours = [values[name] for name in compiled.effect_parameters]
        return np.concatenate([self.parameters.vector(), ours, [1.0 if self.doc_sign else -1.0]])


@dataclass(frozen=True)
class _CompiledForm:
    """A compiled form. effect_parameters: full names, in order; states: all, in order; memory: those of the effects."""

    scanner: Scanner
    states: tuple[str, ...]
    substeps: bool = False
    effect_parameters: tuple[str, ...] = ()
    memory: tuple[Memory, ...] = ()

    def first(self, p: Parameters, x: float) -> dict[str, float]:
        """The states at rest at x [m], by name; zero where not named."""
        if not self.substeps:
            return play_form.start(p, x)
        start: dict[str, float] = {"air": servomotor.start_air(p, x), "x": x, "lever": x / p.stroke}
        names = self.states[len(self.states) - len(self.memory) :]
        return start | {name: x if m.at_position else m.start for name, m in zip(names, self.memory, strict=True)}


@functools.lru_cache(maxsize=32)
def _built(form: Form, effects: tuple[Effect, ...], _compiler: tuple[str, ...] | None) -> _CompiledForm:
    """One compiled form per form of friction, choice of effects and way of compiling."""
    if form == "play":
        return _CompiledForm(Scanner(play_form.play_form()), play_form.STATES)
    recurrence, layout = force_form.force_form(effects)
    states = force_form.state_names(layout)
    return _CompiledForm(Scanner(recurrence), states, True, layout.parameters, layout.memory)


def _effect_values(actuator: Actuator) -> dict[str, float]:
    """Default values of the base effects, typical sizes of the others, and what was given."""
    base = force_form.base_values(actuator.parameters)
    named = {}
    for effect in actuator.chosen:
        default = base.get(effect.id) or {p.symbol: p.scale for p in effect.parameters}
        for symbol, value in (default | dict(actuator.effects.get(effect.id, {}))).items():
            named[effect.parameter_name(symbol)] = float(value)
    return named


def _check_effect(catalogue: Catalogue, name: str, values: Mapping[str, float]) -> None:
    if name not in catalogue:
        raise BadInput("actuator", f"there is no effect '{name}'", nearest(name, catalogue.ids))
    known = {parameter.symbol: parameter for parameter in catalogue[name].parameters}
    for symbol, value in values.items():
        where = f"actuator: effect {name}"
        if symbol not in known:
            raise BadInput(where, f"it has no parameter '{symbol}'", nearest(symbol, tuple(known)))
        if not (math.isfinite(value) and known[symbol].allows(value)):
            found = f"{symbol} is {value:g} {known[symbol].unit}"
            raise BadInput(where, found, f"it is a number {known[symbol].bounds}")
        if symbol == catalogue[name].delay and value > past.LONGEST:
            found = f"{symbol} is {value:g} {known[symbol].unit}"
            raise BadInput(where, found, f"in the actuator a dead time is {past.LONGEST:g} s at most")


def _checked(inputs: Array, more: int) -> Array:
    """The inputs as a new array with `more` rows like the last one, fault strengths within their limits."""
    given = np.asarray(inputs, float)
    if given.ndim != 2 or given.shape[1] != len(INPUTS) or not len(given):
        found, allowed = f"their shape is {given.shape}", f"it is (n_steps, {len(INPUTS)}), one row at least"
        raise BadInput("actuator inputs", found, allowed)
    u = np.empty((len(given) + more, len(INPUTS)))
    u[: len(given)], u[len(given) :] = given, given[-1]
    if not np.isfinite(u).all():
        row, column = np.argwhere(~np.isfinite(u))[0]
        found = f"{INPUTS[column]} of step {row} is {u[row, column]:g}"
        raise BadInput("actuator inputs", found, "inputs are finite numbers")
    u[:, -len(FAULTS) :] = limited(u[:, -len(FAULTS) :])
    return u


def _frozen(values: Any) -> Array:
    values.flags.writeable = False
    return values
