"""What an effect is: one piece of a valve's physics, written once and used everywhere.

An effect says where it acts, which parameters and memory it has, and its equations as CasADi expressions. Simulation,
sensitivities, fitting, the score test and the documentation all read this one definition. To add an effect, copy a
file of `simulator/effects/`, change the physics, and add its class to the list in `simulator/effects/__init__.py`.

The equation of motion that the kernel assembles from the effects is

    sum over effects of force(q) = u_eff,        u_eff = input_N(... input_1(u))

with the acceleration among the quantities `q`, so that inertia is an effect like any other. What is measured is
y = output_M(... output_1(x)).
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import ClassVar, Literal

from simulator.first_look import FirstLook, Guess, Missing, Trial
from simulator.pulls import most_pulled
from simulator.relaxation import Expression as Expression
from simulator.relaxation import Law

Values = Mapping[str, Expression]
"""Expressions by symbol: parameters or memory states of one effect."""


class Site(Enum):
    """Where an effect enters the balance of forces; it decides which of the hooks the effect may have.

    >>> from simulator import CATALOGUE
    >>> CATALOGUE["backlash"].site, CATALOGUE["quadratic_drag"].site
    (<Site.OUTPUT: 'output'>, <Site.FORCE: 'force'>)
    """

    FORCE = "force"
    INPUT = "input"
    OUTPUT = "output"


@dataclass(frozen=True)
class Parameter:
    """A physical constant of an effect.

    symbol : name in equations and files; unit : SI unit; lower, upper : physical bounds, in `unit`;
    scale : typical magnitude, in `unit`; neutral : the value at which the effect vanishes, None for the base effects
    and for what only shapes an effect (the place of a tight spot) while another parameter sets its strength;
    positive : whether its logarithm is the natural coordinate (it spans decades); known : what of the
    valve it is to be held at (``stroke``), because a change of it looks like one of the base effects, empty where it is
    free; meaning : one line in words.

    >>> rate = Parameter("K", "N/m", "spring rate", scale=5e4, lower=0.0)
    >>> rate.allows(-1.0), rate.bounds
    (False, 'from 0 to inf N/m')
    """

    symbol: str
    unit: str
    meaning: str
    scale: float
    lower: float = float("-inf")
    upper: float = float("inf")
    neutral: float | None = None
    positive: bool = False
    known: Literal["", "stroke"] = ""

    def allows(self, value: float) -> bool:
        """Whether a value, in `unit`, lies within the physical bounds."""
        return self.lower <= value <= self.upper

    @property
    def bounds(self) -> str:
        """The physical bounds in words: ``from 0 to 1 m``."""
        return f"from {self.lower:g} to {self.upper:g} {self.unit}"


@dataclass(frozen=True)
class Quantities:
    """What is known at an instant, or as the mean over a step: SI units, CasADi expressions.

    t time [s], x position [m], v velocity [m/s], a acceleration [m/s2] (0 where only a sample is known, so for an
    output), u force of the actuator on the stem [N] behind the input effects asked so far, y position [m] behind the
    output effects asked so far, friction : factor on the friction level by the effects asked so far [1], speed :
    velocity at which friction levels are read [m/s], v unless an effect says otherwise, late : the recorded force a
    `delay` earlier less the one now [N], where an effect has one.
    """

    t: Expression
    x: Expression
    v: Expression
    a: Expression
    u: Expression
    y: Expression
    friction: Expression = 1.0
    speed: Expression = 0.0
    late: Expression = 0.0


@dataclass(frozen=True)
class Memory:
    """One state of an effect: its symbol, unit, and how it starts.

    start : initial value in `unit`; free : whether a fit may adjust the start (False: it is known);
    at_position, at_force : the state starts at the position (sensors) or at the actuating force (actuators) instead.
    """

    symbol: str
    unit: str
    start: float = 0.0
    free: bool = False
    at_position: bool = False
    at_force: bool = False


class Effect(ABC):
    """One piece of physics. Every hook has a neutral default; a concrete effect overrides what it needs.

    `memory` states that follow a law are named by `relax`; all others are set by `jump` (play operators, stacks).
    The kernel asks effects on the input first, then those that set level or speed of friction, then the other forces,
    then effects on the output; within each of these groups in the order of the catalogue. In a step, `s` holds the mean
    of a relaxing state, and what a jumping state is at mid-step; at a sample it holds what they are.

    >>> class Magnet(Effect):
    ...     id, site, sentence = "magnet", Site.FORCE, "a magnet pulls the stem"
    ...     parameters = (Parameter("G", "N", "pull", scale=50.0, neutral=0.0),)
    ...
    ...     def force(self, q, p, s, ds):
    ...         return p["G"]
    >>> Magnet().parameter_names()
    ('magnet.G',)
    """

    id: ClassVar[str]
    site: ClassVar[Site]
    sentence: ClassVar[str]
    """What the effect means for a valve, in one sentence."""
    check: ClassVar[str] = ""
    """What to check on site."""
    parameters: ClassVar[tuple[Parameter, ...]]
    memory: ClassVar[tuple[Memory, ...]] = ()
    prefix: ClassVar[str] = ""
    """Prefix of the parameter names when it is not the id."""
    delay: ClassVar[str] = ""
    """Symbol of the parameter [s] by which the kernel looks back in the recorded force for `q.late`. Site INPUT."""
    imitated: ClassVar[bool] = False
    """Whether a base model imitates the effect by bending its own parameters, so that little of it seems missing."""
    passive: ClassVar[bool] = False
    """Whether, started at rest at x = 0, the effect never delivers more energy than it took up, at any values."""

    def relax(self, q: Quantities, p: Values) -> Mapping[str, Law]:
        """Laws of the relaxing memory states, by symbol: `Relaxation` or `Lag`."""
        return {}

    def jump(self, q: Quantities, p: Values, s: Values) -> Mapping[str, Expression]:
        """New values of the other memory states, by symbol, from those at the start of the step.

        Asked for the middle and for the end of a step, each time from its start: it must not count steps.
        """
        return {}

    def friction_level(self, q: Quantities, p: Values, s: Values) -> Expression:
        """Factor on the Coulomb and Stribeck levels of the friction effects, 1 when neutral. Site FORCE."""
        return 1.0

    def friction_speed(self, q: Quantities, p: Values, s: Values) -> Expression:
        """The velocity [m/s] at which the friction effects read their level, `q.speed` when neutral. Site FORCE."""
        return q.speed

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        """Force against the motion [N], given the memory `s` and the rates of change `ds` of its relaxing states.

        Site FORCE.
        """
        return 0.0

    def input(self, q: Quantities, p: Values, s: Values) -> Expression:
        """The actuating force [N] behind this effect, given the one before it, `q.u`. Site INPUT."""
        return q.u

    def output(self, q: Quantities, p: Values, s: Values) -> Expression:
        """The position [m] behind this effect, given the one before it, `q.y`. Site OUTPUT."""
        return q.y

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """Values from which a fit of this effect is to start, likeliest first, SI units by full parameter name, given
        the values of a fitted model without it: what an engineer reads off the loop, the friction-velocity map or the
        force that the model lacks. Without any, tracing starts at the scales of its parameters.

        It may name base parameters, too. Those it has to where the model `imitates` it: once they are bent, a little of
        the effect improves nothing, and the way back is barred.
        """
        return ()

    def parameter_name(self, symbol: str) -> str:
        """The full name of a parameter, as files have it: ``spring.K``."""
        return f"{self.prefix or self.id}.{symbol}"

    def parameter_names(self) -> tuple[str, ...]:
        """The full names of all parameters, in order."""
        return tuple(self.parameter_name(p.symbol) for p in self.parameters)

    def named(self, **values: float) -> dict[str, float]:
        """Values by symbol as values by full name, each within its bounds."""
        known = {p.symbol: p for p in self.parameters}
        return {self.parameter_name(s): min(max(v, known[s].lower), known[s].upper) for s, v in values.items()}

    def guessed(self, guess: Guess | None, *beside: str) -> list[dict[str, float]]:
        """A guess as `first_guess` returns it, with the values of some base parameters that go with it."""
        return [] if guess is None else [{name: guess.base[name] for name in beside} | self.named(**guess.values)]

    def guessed_shapes(
        self, recordings: Sequence[FirstLook], base: Mapping[str, float], trials: Sequence[Trial], *beside: str
    ) -> list[dict[str, float]]:
        """The shape of a force that explains most of what is missing, with the values of some base parameters that go
        with it, and the shapes at which the measurements pull most, where a regression may not show them.
        """
        missing, pulled = Missing.of(recordings, base), most_pulled(recordings, base, trials)
        others = (guess for trial in pulled for guess in self.guessed(missing.best([trial])))
        return [*self.guessed(missing.best(trials), *beside), *others]

    def __eq__(self, other: object) -> bool:
        """Effects are values: one that was copied or sent to another process finds the kernels of the first."""
        return type(self) is type(other) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash(type(self))


@dataclass(frozen=True)
class Catalogue:
    """The effects that can be simulated, fitted and named, in the order of asking (see `Effect`).

    It is a value: whoever looks an effect up is handed one, `CATALOGUE` where nothing else is said.
    Raises ValueError when two effects have the same id or parameter name.

    >>> from simulator import CATALOGUE
    >>> CATALOGUE.ids[:3], CATALOGUE["spring"].sentence
    (('inertia', 'spring', 'lugre'), 'the actuator spring and its preload, which set the bench-set range')
    """

    effects: tuple[Effect, ...]
    _by_id: dict[str, Effect] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        ids = [effect.id for effect in self.effects]
        names = [name for effect in self.effects for name in effect.parameter_names()]
        twice = sorted({name for group in (ids, names) for name in group if group.count(name) > 1})
        if twice:
            raise ValueError(f"the catalogue has {twice[0]!r} twice; give each effect its own id and prefix")
        object.__setattr__(self, "_by_id", {effect.id: effect for effect in self.effects})

    def __repr__(self) -> str:
        return f"<Catalogue of {len(self.effects)} effects: {', '.join(self.ids)}>"

    @property
    def ids(self) -> tuple[str, ...]:
        """All ids, in order."""
        return tuple(self._by_id)

    def __getitem__(self, effect_id: str) -> Effect:
        return self._by_id[effect_id]

    def __contains__(self, effect_id: object) -> bool:
        return effect_id in self._by_id

    def extended(self, *effects: Effect) -> Catalogue:
        """This catalogue with further effects at its end: how to use effects of your own.

        Effects of one site are asked in the order of the catalogue. So at the end an effect on the input changes the
        force last, next to the stem; one on the output changes the reading last, as a transmitter does; one on the
        force sees what those before it made of friction's level and speed. Where yours belongs elsewhere, build a
        `Catalogue` of the effects in your own order. The base effects stay first.
        """
        return Catalogue((*self.effects, *effects))

    def parameters(self, ids: Iterable[str]) -> dict[str, Parameter]:
        """The parameters of some effects by full name, effects in the order of `ids`.

        Raises KeyError for an unknown id.

        >>> from simulator import CATALOGUE
        >>> list(CATALOGUE.parameters(["spring", "inertia"]))
        ['spring.K', 'spring.F0', 'mass.m']
        """
        return {e.parameter_name(p.symbol): p for e in map(self.__getitem__, ids) for p in e.parameters}

    def pick(self, ids: tuple[str, ...]) -> tuple[Effect, ...]:
        """The named effects in catalogue order. Raises KeyError for an unknown id."""
        missing = set(ids) - set(self._by_id)
        if missing:
            raise KeyError(f"no effect named {sorted(missing)[0]!r}; there are {', '.join(self._by_id)}")
        return tuple(effect for effect in self.effects if effect.id in ids)
