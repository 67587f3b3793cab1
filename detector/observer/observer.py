"""The adaptive observer of the source's Chapter 4: sample in, decision out.

What is corrected against the print, each form also to be had by name:

- (4.20), b1: printed P{xi2}, here P{abs(xi2)}, which the Lyapunov argument needs (``law_b1="printed"``).
- (4.24): printed +Phi eps_s xi2, here -Phi eps_s xi2; for tanh, abs(eps_s xi) <= 0.2785 delta (`theory`).
- (4.27): no absence of false alarms by construction; see `detector.observer.decision.threshold`.
- (5.1), 5.3: printed xi2 >= rho, here abs(xi2) > rho (``Rule(residual="printed")``).
- Phi feeds back only as long as it is not negative; under the printed law of b1 it can be (``least_phi=-inf``).
The law of alpha5 stands as printed: its cross-term xi1 xi2 cancels, which leaves -xi2 x1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from detector.observer import kernel
from detector.observer.approximators import Approximator, HighOrder, Table
from detector.observer.decision import ABSOLUTE, PRINTED, Rule
from detector.observer.projection import RADIAL, SMOOTH
from detector.observer.sample import Sample, Samples, Screening, screen
from detector.observer.smooth_sign import SAT, TANH
from detector.observer.state import Decision, Decisions, State
from detector.observer.velocity import Measured, Velocity
from recordings import BadInput

S1 = HighOrder(order=2, inputs=2, m=1.41, l=-10.0225, c=0.5974, lam=-2.11)
S2 = HighOrder(order=5, inputs=1, m=0.8, l=-4.0, c=2.119, lam=-1.5)
"""The networks of Sections 4.4 and 5.3: S1 of x2 and abs(x2), S2 of abs(x2)."""


@dataclass(frozen=True)
class Start:
    """Initial estimates: alpha1 [1/s], alpha4 [1/kg], alpha5 [1/s^2] of (4.5) in the observer's units; e1; b1
    [acceleration]; the weights w1, w2 start at zero.
    """

    alpha1: float = 1.0
    alpha4: float = 1.0
    alpha5: float = 1.0
    e1: float = 0.0
    b1: float = 0.0


@dataclass(frozen=True)
class Bounds:
    """Radii of the sets in (4.20): Ma of w1, Mb of w2, Mc of e1, Md of b1, Me, Mf, Mg of alpha1, alpha4, alpha5."""

    w1: float = 1000.0
    w2: float = 1000.0
    e1: float = 1000.0
    b1: float = 1000.0
    alpha1: float = 1000.0
    alpha4: float = 1000.0
    alpha5: float = 1000.0


@dataclass(frozen=True)
class Observer:
    """The observer (4.12)-(4.20) with threshold and decision; holds no socket, clock, file or state.

    k1, k2 : gains [1/s]; s1 (two inputs), s2 (one) : approximators; start, bounds : of the adapted parameters;
    weight_gain : adaptation gain of w1, w2, e1, b1; alpha_gain : of alpha1, alpha4, alpha5, 0 to keep them;
    sigm, delta : the smooth sign and its width [velocity]; dead_zone : adapt only while abs(xi2) >= dead_zone rho,
    without which Phi grows for ever and the detector goes deaf; freeze : no adaptation during an alarm; least_phi :
    lowest Phi; rule : when it is an alarm; velocity : where x2 comes from; screening : what is plausible.
    Keep weight_gain abs(S)^2 Ts / k2 below 1, and so for alpha and its signals: scale the signals.
    Raises BadInput at the first use for constants that cannot be.

    >>> state, decision = Observer().step(Observer().initial(), Sample(0.0, position=0.0, input=0.0, velocity=0.0))
    >>> decision.verdict.name, decision.alarm
    ('START', False)
    """

    k1: float = 100.0
    k2: float = 200.0
    s1: Approximator = S1
    s2: Approximator = S2
    start: Start = field(default_factory=Start)
    bounds: Bounds = field(default_factory=Bounds)
    weight_gain: float = 1.0
    alpha_gain: float = 1.0
    sigm: Literal["tanh", "sat"] = "tanh"
    delta: float = 0.06
    law_b1: Literal["absolute", "printed"] = "absolute"
    projection: Literal["radial", "smooth"] = "radial"
    dead_zone: float = 0.0
    freeze: bool = False
    least_phi: float = 0.0
    rule: Rule = field(default_factory=Rule)
    velocity: Velocity = field(default_factory=Measured)
    screening: Screening = field(default_factory=Screening)

    def initial(self) -> State:
        """The state before the first sample."""
        core = np.zeros(kernel.WEIGHTS + sum(len(table.powers) for table in self._tables))
        places = [kernel.A1, kernel.A4, kernel.A5, kernel.E1, kernel.B1]
        core[places] = [self.start.alpha1, self.start.alpha4, self.start.alpha5, self.start.e1, self.start.b1]
        return State(core, np.zeros(4), self.velocity.start(), len(self._tables[0].powers))

    def step(self, state: State, sample: Sample) -> tuple[State, Decision]:
        """One sample; bit for bit what `run` makes of it in a row."""
        state, decisions = self.run(state, Samples.row([sample]))
        return state, decisions[0]

    def run(self, state: State, samples: Samples, *, history: bool = False) -> tuple[State, Decisions]:
        """Many samples, in any blocks: the decisions do not depend on how a row is cut.

        history : also keep the observer's state after every sample, for studies. Raises BadInput for a state of
        another observer.
        """
        if len(state.core) != len(self.initial().core) or len(state.filter) != len(self.velocity.start()):
            raise BadInput("observer state", "it is of another observer", "start with `initial()` of this one")
        n, screening, core = len(samples), state.screening.copy(), state.core.copy()
        dt, verdict = np.empty(n), np.empty(n, np.int64)
        screen(screening, self.screening.limits(), samples.time_s, samples.position, samples.input, samples.velocity,
               samples.quality, isinstance(self.velocity, Measured), dt, verdict)  # fmt: skip
        motion = self.velocity.run(state.filter, dt, samples.position, samples.velocity)
        said, past = np.empty((n, 5)), np.empty((n if history else 0, len(core)))
        first, second = self._tables
        kernel.advance(core, dt, motion.position, motion.velocity, samples.input, self.numbers,
                       *first, *second, said, past)  # fmt: skip
        after = State(core, screening, motion.state, state.n_first)
        return after, Decisions(samples.time_s, said, verdict, past if history else None, state.n_first)

    @cached_property
    def _tables(self) -> tuple[Table, Table]:
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
        numbers = (
            self.k1, self.k2, self.delta, {"tanh": TANH, "sat": SAT}[self.sigm], self.law_b1 == "printed",
            {"radial": RADIAL, "smooth": SMOOTH}[self.projection], self.weight_gain, self.alpha_gain,
            *(getattr(self.bounds, name) for name in ("w1", "w2", "e1", "b1", "alpha1", "alpha4", "alpha5")),
            self.dead_zone, self.freeze, self.least_phi, self.rule.consecutive, self.rule.latch, self.rule.settle_s,
            {"absolute": ABSOLUTE, "printed": PRINTED}[self.rule.residual],
        )  # fmt: skip
        return kernel.Numbers(*map(float, numbers))
