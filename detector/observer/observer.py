"""The adaptive observer of the source's Chapter 4: sample in, decision out.

What is corrected against the print, each form also to be had by name:

- (4.20), b1: printed P{xi2}, here P{abs(xi2)}, which the Lyapunov argument needs (``law_b1="printed"``).
- (4.24): printed +Phi eps_s xi2, here -Phi eps_s xi2; for tanh, abs(eps_s xi) <= 0.2785 delta (`theory`).
- (4.27): no absence of false alarms by construction; see `detector.observer.alarm_rule.threshold`.
- (5.1), 5.3: printed xi2 >= rho, here abs(xi2) > rho (``AlarmRule(residual="printed")``).
- Phi feeds back only as long as it is not negative; under the printed law of b1 it can be (``least_phi=-inf``).
The law of alpha5 stands as printed: its cross-term xi1 xi2 cancels, which leaves -xi2 x1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from detector.observer import kernel
from detector.observer.alarm_rule import ABSOLUTE, PRINTED, AlarmRule
from detector.observer.approximators import Approximator, CodedApproximator, HighOrder
from detector.observer.projection import RADIAL, SMOOTH
from detector.observer.screening import N_SCREEN, SampleVerdict, Screening, screen
from detector.observer.smooth_sign import SAT, TANH
from detector.observer.state import Decision, Decisions, ObserverState
from detector.observer.velocity import Measured, Velocity
from recordings import Array, BadInput, Integers

S1 = HighOrder(order=2, inputs=2, m=1.41, l=-10.0225, c=0.5974, lam=-2.11)
S2 = HighOrder(order=5, inputs=1, m=0.8, l=-4.0, c=2.119, lam=-1.5)
"""The networks of Sections 4.4 and 5.3: S1 of x2 and abs(x2), S2 of abs(x2)."""


@dataclass(frozen=True)
class Start:
    """Initial estimates: alpha1 [1/s], alpha4 [1/kg], alpha5 [1/s^2] of (4.5) in the observer's units; e1; b1
    [acceleration]; the weights w1, w2, all zero where none are given.
    """

    alpha1: float = 1.0
    alpha4: float = 1.0
    alpha5: float = 1.0
    e1: float = 0.0
    b1: float = 0.0
    w1: tuple[float, ...] = ()
    w2: tuple[float, ...] = ()


@dataclass(frozen=True)
class Bounds:
    """Radii of the sets in (4.20): Ma of w1, Mb of w2, Mc of e1, Md of b1, Me, Mf, Mg of alpha1, alpha4, alpha5.

    about_start : the sets are about the initial estimates, so that the laws can follow a change so far and no further;
    else about zero, as in the source.
    """

    w1: float = 1000.0
    w2: float = 1000.0
    e1: float = 1000.0
    b1: float = 1000.0
    alpha1: float = 1000.0
    alpha4: float = 1000.0
    alpha5: float = 1000.0
    about_start: bool = False


@dataclass(frozen=True)
class Observer:
    """The observer (4.12)-(4.20) with threshold and decision; holds no socket, clock, file or state.

    k1, k2 : gains [1/s]; s1 (two inputs), s2 (one) : approximators; start, bounds : of the adapted parameters;
    weight_gain : adaptation gain of w1, w2, e1, b1, or one of w1, e1 and one of w2, b1; alpha_gain : of alpha1, alpha4,
    alpha5, one for all or one each, 0 to keep them; sigm, delta : the smooth sign and its width [velocity]; dead_zone :
    Phi adapts only while abs(xi2) >= dead_zone rho, without which it grows for ever and the detector goes deaf;
    alpha_dead_zone : the same of the alphas, whose laws have signs, None for dead_zone; least_speed : no law runs below
    it, for what holds a resting stem tells nothing of its motion; adapt_after_s : nor so soon [s] after a start or a
    gap; freeze : no adaptation during an alarm; least_phi : lowest Phi; rule : when it is an alarm; velocity : where x2
    comes from; screening : what is plausible.
    Keep weight_gain abs(S)^2 Ts / k2 below 1, and so for alpha and its signals: scale the signals.
    Raises BadInput at the first use for constants that cannot be.

    >>> observer = Observer()
    >>> state, decision = observer.step(observer.initial(), 0.0, position=0.0, input=0.0, velocity=0.0)
    >>> decision.verdict.name, decision.alarm
    ('START', False)
    """

    k1: float = 100.0
    k2: float = 200.0
    s1: Approximator = S1
    s2: Approximator = S2
    start: Start = field(default_factory=Start)
    bounds: Bounds = field(default_factory=Bounds)
    weight_gain: float | tuple[float, float] = 1.0
    alpha_gain: float | tuple[float, float, float] = 1.0
    sigm: Literal["tanh", "sat"] = "tanh"
    delta: float = 0.06
    law_b1: Literal["absolute", "printed"] = "absolute"
    projection: Literal["radial", "smooth"] = "radial"
    dead_zone: float = 0.0
    alpha_dead_zone: float | None = None
    least_speed: float = 0.0
    adapt_after_s: float = 0.0
    freeze: bool = False
    least_phi: float = 0.0
    rule: AlarmRule = field(default_factory=AlarmRule)
    velocity: Velocity = field(default_factory=Measured)
    screening: Screening = field(default_factory=Screening)

    def initial(self) -> ObserverState:
        """The state before the first sample."""
        return ObserverState(
            self._start.copy(), np.zeros(N_SCREEN), self.velocity.start(), len(self.tables[0].powers)
        )  # fmt: skip

    def step(
        self, state: ObserverState, time_s: float, position: float, input: float, velocity: float = math.nan,
        quality: int = SampleVerdict.USED,
    ) -> tuple[ObserverState, Decision]:  # fmt: skip
        """One sample; bit for bit what `run` makes of it in a row."""
        t, x, u, v = np.array([[time_s], [position], [input], [velocity]])
        state, decisions = self._advanced(state, t, x, u, v, np.array([quality]), False)
        return state, decisions[0]

    def run(
        self, state: ObserverState, time_s: ArrayLike, position: ArrayLike, input: ArrayLike,
        velocity: ArrayLike | None = None, *, quality: ArrayLike | None = None, history: bool = False,
    ) -> tuple[ObserverState, Decisions]:  # fmt: skip
        """Many samples, in any blocks: the decisions do not depend on how a row is cut.

        time_s [s] : rising, of any origin; position, input : in the units that the observer is set up for; velocity :
        where it is measured; all (n_samples,), NaN where there is no value. quality (n_samples,) : what the source
        says of each sample, `SampleVerdict.USED` where it is good, else `SampleVerdict.STALE` or
        `SampleVerdict.BAD`; None for all good. history : also keep the state after every sample, for studies.

        Raises BadInput for rows of different lengths, and for a state of another observer.
        """
        return self._advanced(state, *_rows(time_s, position, input, velocity, quality), history)

    def _advanced(
        self, state: ObserverState, t: Array, x: Array, u: Array, v: Array, trust: Integers, history: bool
    ) -> tuple[ObserverState, Decisions]:  # fmt: skip
        """`run` on rows that are as they should be."""
        if len(state.core) != len(self._start) or len(state.filter) != len(self.velocity.start()):
            raise BadInput("observer state", "it is of another observer", "start with `initial()` of this one")
        n, screening, core = len(t), state.screening.copy(), state.core.copy()
        dt, verdict = np.empty(n), np.empty(n, np.int64)
        screen(screening, self._limits, t, x, u, v, trust, isinstance(self.velocity, Measured), dt, verdict)
        filter, x1, x2 = self.velocity.run(state.filter, dt, x, v)
        output, past = np.empty((n, 5)), np.empty((n if history else 0, len(core)))
        first, second = self.tables
        kernel.advance(core, self.centre, dt, x1, x2, u, self.numbers, *first, *second, output, past)
        after = ObserverState(core, screening, filter, state.n_first)
        return after, Decisions(t, output, verdict, past if history else None, state.n_first)

    @cached_property
    def _limits(self) -> Array:
        """What is plausible, as the compiled screen takes it."""
        return self.screening.limits()

    @cached_property
    def _start(self) -> Array:
        """The estimates before the first sample, (n_core,)."""
        start, n_terms = self.start, [len(table.powers) for table in self.tables]
        core = np.zeros(kernel.WEIGHTS + sum(n_terms))
        places = [kernel.A1, kernel.A4, kernel.A5, kernel.E1, kernel.B1]
        core[places] = [start.alpha1, start.alpha4, start.alpha5, start.e1, start.b1]
        first = kernel.WEIGHTS
        for name, weights, n in (("w1", start.w1, n_terms[0]), ("w2", start.w2, n_terms[1])):
            if weights and len(weights) != n:
                raise BadInput(f"observer: {name}", f"{len(weights)} weights are given", f"give {n}, or none")
            core[first : first + len(weights)] = weights
            first += n
        return core

    @cached_property
    def centre(self) -> Array:
        """The middle of the sets of the laws, at the places of the state (n_core,)."""
        return self._start if self.bounds.about_start else np.zeros(len(self._start))

    @cached_property
    def tables(self) -> tuple[CodedApproximator, CodedApproximator]:
        """Both networks as numbers. Raises BadInput for those with other inputs."""
        if (self.s1.inputs, self.s2.inputs) != (2, 1):
            raise BadInput("observer", f"S1 has {self.s1.inputs} inputs and S2 {self.s2.inputs}",
                           "S1 takes x2 and abs(x2), S2 abs(x2) alone")  # fmt: skip
        return self.s1.table(), self.s2.table()

    @cached_property
    def numbers(self) -> kernel.Numbers:
        """The constants as the compiled step takes them. Raises BadInput for those that cannot be."""
        for name in ("k1", "k2", "delta"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise BadInput(f"observer: {name}", f"it is {getattr(self, name)}", "give a positive number")
        weights = self.weight_gain if isinstance(self.weight_gain, tuple) else (self.weight_gain,) * 2
        alphas = self.alpha_gain if isinstance(self.alpha_gain, tuple) else (self.alpha_gain,) * 3
        of_alphas = self.dead_zone if self.alpha_dead_zone is None else self.alpha_dead_zone
        numbers = (
            self.k1, self.k2, self.delta, {"tanh": TANH, "sat": SAT}[self.sigm], self.law_b1 == "printed",
            {"radial": RADIAL, "smooth": SMOOTH}[self.projection], *weights, *alphas,
            *(getattr(self.bounds, name) for name in ("w1", "w2", "e1", "b1", "alpha1", "alpha4", "alpha5")),
            self.dead_zone, of_alphas, self.least_speed, self.adapt_after_s, self.freeze, self.least_phi,
            self.rule.consecutive, self.rule.latch, self.rule.settle_s,
            {"absolute": ABSOLUTE, "printed": PRINTED}[self.rule.residual],
        )  # fmt: skip
        return kernel.Numbers(*map(float, numbers))


def _rows(
    time_s: ArrayLike, position: ArrayLike, input: ArrayLike, velocity: ArrayLike | None, quality: ArrayLike | None
) -> tuple[Array, Array, Array, Array, Integers]:
    """The arguments of `Observer.run` as arrays (n_samples,). Raises BadInput for other shapes."""
    t = np.array(time_s, float)
    v = np.full(t.shape, math.nan) if velocity is None else np.array(velocity, float)
    trust = np.zeros(t.shape, np.int64) if quality is None else np.array(quality, np.int64)
    x, u = np.array(position, float), np.array(input, float)
    for name, row in (("time_s", t), ("position", x), ("input", u), ("velocity", v), ("quality", trust)):
        if t.ndim != 1 or row.shape != t.shape:
            found = f"its shape is {row.shape}, the time's {t.shape}"
            raise BadInput(f"samples: {name}", found, "give one row of equal length each")
    return t, x, u, v, trust
