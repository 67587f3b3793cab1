"""A recurrence s -> s' as CasADi expressions, written once, and what makes a loop over it callable.

`step` writes the recurrence of a valve; `c_loop` and `numba_loop` compile the loops; `scan` runs them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from recordings import Array
from simulator.relaxation import Expression

MOTION = 2
"""Position and velocity are the first states."""
GAMMA = 1.0 - 0.5**0.5
"""Share of a sub-step that each stage of SDIRK2 takes."""
AHEAD = (1.0 - GAMMA) / GAMMA
"""How far beyond its first stage, in units of what that moved, the second one starts."""


class Sizes(NamedTuple):
    """Lengths of the vectors of a recurrence: state, exo, parameters, output, and inputs per sample."""

    states: int
    exo: int
    parameters: int
    outputs: int
    inputs: int


@dataclass(frozen=True)
class Recurrence:
    """One sub-step of a system, as column vectors of CasADi SX symbols and the expressions in them.

    state (n_states); exo = [t_mid, h, inputs...] (2 + n_inputs): time at mid-step [s], step [s], inputs at mid-step,
    followed by the inputs at the end of the sub-step when `ends`; parameters (n_parameters); step: the next state;
    output: what is measured at the start of a sample, in which ``exo`` holds the sample's own time, h = 0 and inputs.
    An implicit scalar w (for example the velocity at mid-step) is solved from residual(w) = 0, residual rising
    through its root, started at guess (in state); scale: a small w; differentiable: whether sensitivities will be
    asked for: without them a large system builds several times faster; ahead (n_states,): where the expressions are a
    stage of SDIRK2, how far its second stage starts beyond the first, `AHEAD`, or 1 for memory that jumps; empty where
    they are the whole step.
    """

    state: Expression
    exo: Expression
    parameters: Expression
    step: Expression
    output: Expression
    implicit: Expression | None = None
    residual: Expression | None = None
    guess: Expression | None = None
    scale: float = 1e-5
    ends: bool = False
    differentiable: bool = True
    ahead: tuple[float, ...] = ()

    @property
    def sizes(self) -> Sizes:
        """Lengths of its vectors."""
        state, exo, parameters, output = (
            int(ca.SX(x).numel()) for x in (self.state, self.exo, self.parameters, self.output)
        )
        return Sizes(state, exo, parameters, output, (exo - 2) // (2 if self.ends else 1))

    def functions(
        self, columns: Sequence[int] | None = None, names: Sequence[str] | None = None
    ) -> dict[str, ca.Function]:
        """The functions a loop needs, with the implicit scalar differentiated through its equation.

        columns : which parameters derivatives are taken by, in this order; all where None; names : which functions, all
        where None. Without an implicit scalar the equation is w = 0, so that one loop serves all.
        """
        by = self.parameters if columns is None else self.parameters[list(columns)]
        w = ca.SX.sym("w") if self.implicit is None else self.implicit
        residual = w if self.residual is None else self.residual
        arguments = {"w": w, "s": self.state, "e": self.exo, "p": self.parameters}
        whole: dict[str, tuple[str, Callable[[], list[Expression]]]] = {
            "step": ("wsep", lambda: [self.step]),
            "step_jac": ("wsep", lambda: [self.step, *self._jacobian(w, residual, by)]),
            "output": ("sep", lambda: [self.output]),
            "output_jac": ("sep", lambda: [self.output, *(ca.jacobian(self.output, z) for z in (self.state, by))]),
            "residual": ("wsep", lambda: [residual, ca.jacobian(residual, w)]),
            "guess": ("sep", lambda: [ca.SX(0.0) if self.guess is None else self.guess]),
        }
        made = {}
        for name in whole if names is None else names:
            letters, expressions = whole[name]
            outputs = [ca.densify(output) for output in ca.cse(expressions())]
            given = [arguments[letter] for letter in letters]
            made[name] = ca.Function(name, given, outputs, list(letters), [f"o{i}" for i in range(len(outputs))])
        return made

    def carried(self, columns: Sequence[int]) -> ca.Function:
        """carried(w, s, e, p, S): the next state and its derivatives by some parameters and by the state of the start,
        from those before, S. Of S (n_states, n_columns + n_states) only what can differ from zero is there.
        """
        w = ca.SX.sym("w") if self.implicit is None else self.implicit
        residual = w if self.residual is None else self.residual
        by_state, by_parameters = self._jacobian(w, residual, self.parameters[list(columns)])
        n = self.sizes.states
        start = ca.horzcat(ca.SX(n, len(columns)), ca.SX.eye(n))
        pattern = ca.SX(start.sparsity(), 1.0)
        while True:
            S = ca.SX.sym("S", pattern.sparsity())
            T = by_state @ S + ca.horzcat(by_parameters, ca.SX(n, n))
            grown = ca.SX(T.sparsity() + pattern.sparsity(), 1.0)
            if grown.nnz() == pattern.nnz():
                break
            pattern = grown
        outputs = ca.cse([ca.densify(self.step), ca.project(T, S.sparsity())])
        return ca.Function("carry", [w, self.state, self.exo, self.parameters, S], outputs, list("wsepS"), ["o0", "o1"])

    def _jacobian(self, w: Expression, residual: Expression, by: Expression) -> tuple[Expression, Expression]:
        """Total derivatives of the step in the state and some parameters, by the implicit function theorem."""
        by_w, slope = self._derivative(self.step, w), ca.jacobian(residual, w)
        direct = [self._derivative(self.step, z) for z in (self.state, by)]
        through = [self._derivative(residual, z) / slope for z in (self.state, by)]
        return direct[0] - by_w @ through[0], direct[1] - by_w @ through[1]

    def _derivative(self, expression: Expression, z: Expression) -> Expression:
        """The jacobian, or zeros where nobody will ask for it."""
        return ca.jacobian(expression, z) if self.differentiable else ca.SX(expression.numel(), z.numel())


Loop = Callable[[Array, Array, bool, float, Array, Array, Array, Array, Array, Array], int]
"""loop(t, u, hold, h_max, p, s, y, S, Y, resets) fills s, y, S and Y and returns the failed sample or -1.

Shapes as in `Scanner.run`; S (n_states, n_columns); Y (n_samples, n_outputs, n_columns) and resets have no rows where
they are not wanted.
"""
Shoot = Callable[[int, int, Array, Array, float, Array, Array, Array, Array, Array, Array, NDArray[np.uint8]], int]
"""shoot(first, last, t, u, h_max, p, z, f, T, y, Y, carried) as in `loop.c`; T and Y have no rows where not wanted."""


class Loops(NamedTuple):
    """The loops around one recurrence."""

    scan: Loop
    shoot: Shoot
