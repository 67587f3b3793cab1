"""Run a recurrence s -> s' over a recording, with forward sensitivities, as fast as the machine allows.

The recurrence is written once as CasADi expressions. Where a C compiler is found they become C, compiled and cached;
where there is none, numba compiles the same operations from Python. Both ways give the same numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from recordings import Array
from simulator.compile import compiled

Expression = Any

MOST_SUB_STEPS = 10**9
"""A run that needs more is refused: it would take the better part of an hour."""


@dataclass(frozen=True)
class Recurrence:
    """One sub-step of a system, as column vectors of CasADi SX symbols and the expressions in them.

    state (n_states); exo = [t_mid, h, inputs...] (2 + n_inputs): time at mid-step [s], step [s], inputs at mid-step,
    followed by the inputs at the end of the sub-step when `ends`; parameters (n_parameters); step: the next state;
    output: what is measured at the start of a sample, in which ``exo`` holds the sample's own time, h = 0 and inputs.
    An implicit scalar w (for example the velocity at mid-step) is solved from residual(w) = 0, residual rising
    through its root, started at guess (in state); scale: a small w; differentiable: whether sensitivities will be
    asked for: without them a large system builds several times faster.
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

    def functions(self) -> dict[str, ca.Function]:
        """The functions a loop needs, with the implicit scalar differentiated through its equation.

        Without an implicit scalar the equation is w = 0, so that one loop serves all.
        """
        w = ca.SX.sym("w") if self.implicit is None else self.implicit
        residual = w if self.residual is None else self.residual
        by_output = [ca.jacobian(self.output, z) for z in (self.state, self.parameters)]
        arguments = {"w": w, "s": self.state, "e": self.exo, "p": self.parameters}
        whole = {
            "step": ("wsep", [self.step]),
            "step_jac": ("wsep", [self.step, *self._jacobian(w, residual)]),
            "output": ("sep", [self.output]),
            "output_jac": ("sep", [self.output, *by_output]),
            "residual": ("wsep", [residual, ca.jacobian(residual, w)]),
            "guess": ("sep", [ca.SX(0.0) if self.guess is None else self.guess]),
        }
        return {
            name: ca.Function(
                name,
                [arguments[letter] for letter in letters],
                [ca.densify(output) for output in ca.cse(outputs)],
                list(letters),
                [f"o{i}" for i in range(len(outputs))],
            )
            for name, (letters, outputs) in whole.items()
        }

    def _jacobian(self, w: Expression, residual: Expression) -> tuple[Expression, Expression]:
        """Total derivatives of the step in the state and the parameters, by the implicit function theorem."""
        by_w, slope = self._derivative(self.step, w), ca.jacobian(residual, w)
        direct = [self._derivative(self.step, z) for z in (self.state, self.parameters)]
        through = [self._derivative(residual, z) / slope for z in (self.state, self.parameters)]
        return direct[0] - by_w @ through[0], direct[1] - by_w @ through[1]

    def _derivative(self, expression: Expression, z: Expression) -> Expression:
        """The jacobian, or zeros where nobody will ask for it."""
        return ca.jacobian(expression, z) if self.differentiable else ca.SX(expression.numel(), z.numel())


class Sizes(NamedTuple):
    """Lengths of the vectors of a recurrence: state, exo, parameters, output, and inputs per sample."""

    states: int
    exo: int
    parameters: int
    outputs: int
    inputs: int


@dataclass(frozen=True)
class Scan:
    """Result of a run. outputs (n_samples, n_outputs); final (n_states): the state at the last sample;
    jacobian (n_samples, n_outputs, n_parameters + n_states): derivatives of the outputs by the parameters and by the
    initial state, when asked for.

    final_jacobian (n_states, n_parameters + n_states): the same derivatives of `final`.

    failed : None, or the first sample at which the state, the output or its derivatives are not finite, or before
    which an implicit step has no solution. From that sample on outputs, jacobian, final and its jacobian are NaN.
    """

    outputs: Array
    final: Array
    failed: int | None
    jacobian: Array | None = None
    final_jacobian: Array | None = None


@dataclass(frozen=True)
class Shots:
    """Result of `Scanner.shoot`.

    ends (n_samples - 1, n_states): where each interval ended; by (n_samples - 1, n_states, n_parameters + n_states):
    derivatives of it by the parameters and by the state it started from; outputs (n_samples, n_outputs) at the path,
    outputs_by (n_samples, n_outputs, n_parameters + n_states); no rows of derivatives when states were carried.
    failed : None, or the sample behind which there is no solution.
    """

    ends: Array
    by: Array
    outputs: Array
    outputs_by: Array
    failed: int | None


class Scanner:
    """A recurrence ready to run: `Scanner(recurrence).run(t, u, p, s0)`; safe to use from several threads.

    Raises NotImplementedError for an operation that needs a C compiler where there is none.
    """

    def __init__(self, recurrence: Recurrence) -> None:
        self.recurrence = recurrence
        ns, ne, np_, ny = (
            int(ca.SX(x).numel()) for x in (recurrence.state, recurrence.exo, recurrence.parameters, recurrence.output)
        )
        self.sizes = Sizes(ns, ne, np_, ny, (ne - 2) // (2 if recurrence.ends else 1))
        functions = recurrence.functions()
        loops = compiled.loops(functions, self.sizes, recurrence.scale)
        self._compiled = loops is not None
        if loops is None:
            from simulator.compile import native  # numba is slow to import and most machines have a compiler

            loops = native.loops(functions, self.sizes.exo, recurrence.scale)
        self._loop, self._shoot = loops

    @property
    def compiled(self) -> bool:
        """Whether a C compiler made the machine code (True) or numba."""
        return self._compiled

    def run(
        self,
        t: Array,
        u: Array,
        p: Array,
        s0: Array,
        *,
        h_max: float = 0.0,
        hold: bool = False,
        sensitivities: bool = False,
        resets: Array | None = None,
    ) -> Scan:
        """Run over samples. t (n_samples) [s], rising; u (n_samples, n_inputs); p (n_parameters); s0 (n_states).

        h_max : largest sub-step [s], 0 for one step per sample; hold : inputs are held from sample to sample instead
        of interpolated linearly; sensitivities : also the jacobian; resets (n_samples, n_states) : values that replace
        states after a sample's output (their sensitivities become zero), NaN where a state goes on.
        Raises ValueError for shapes that do not fit, times that do not rise and a useless h_max.
        """
        if sensitivities and not self.recurrence.differentiable:
            raise ValueError("sensitivities are asked for, and the recurrence was built without (differentiable=False)")
        t, u, p, s, given = self._checked(t, u, p, s0, resets)
        _check_steps(t, h_max)
        ns, _, np_, ny, _ = self.sizes
        columns = np.zeros((ns, np_ + ns))
        columns[:, np_:] = np.eye(ns)
        y, jacobian = np.zeros((len(t), ny)), np.zeros((len(t) if sensitivities else 0, ny, np_ + ns))
        failed = self._loop(t, u, hold, h_max, p, s, y, columns, jacobian, given)
        if failed >= 0:
            y[failed:], jacobian[failed:], s[:], columns[:] = np.nan, np.nan, np.nan, np.nan
        derivatives = (jacobian, columns) if sensitivities else (None, None)
        return Scan(y, s, failed if failed >= 0 else None, *derivatives)

    def shoot(
        self, t: Array, u: Array, p: Array, path: Array, *, h_max: float = 0.0, carried: NDArray[np.bool_] | None = None
    ) -> Shots:
        """Run every interval between samples on its own, each from the state of a given path, with sensitivities.

        t, u, p, h_max : as in `run`; path (n_samples, n_states), C-contiguous; carried (n_states,) : states that start
        where the interval before ended instead, and are written into the path, which is then gone through in one go.
        """
        ns, _, np_, ny, nu = self.sizes
        n, columns = len(t), np_ + ns
        u, p = np.ascontiguousarray(u, float).reshape(n, nu), np.ascontiguousarray(p, float)
        ends, by = np.empty((n - 1, ns)), np.empty((n - 1 if carried is None else 0, ns, columns))
        y, y_by = np.empty((n, ny)), np.empty((n if carried is None else 0, ny, columns))
        mask = np.zeros(ns, np.uint8) if carried is None else carried.astype(np.uint8)
        failed = self._shoot(0, n, t, u, h_max, p, path, ends, by, y, y_by, mask)
        return Shots(ends, by, y, y_by, failed if failed >= 0 else None)

    def _checked(self, t: Array, u: Array, p: Array, s0: Array, resets: Array | None) -> tuple[Array, ...]:
        """The arguments as contiguous arrays of the shapes the loop expects; the state is a copy."""
        ns, _, np_, _, nu = self.sizes
        t = np.ascontiguousarray(t, float).reshape(-1)
        given = np.zeros((0, ns)) if resets is None else resets
        shaped = {
            "u": (u, (len(t), nu)), "p": (p, (np_,)), "s0": (np.array(s0, float), (ns,)),
            "resets": (given, (len(given), ns)),
        }  # fmt: skip
        arrays = [t]
        for name, (array, shape) in shaped.items():
            array = np.ascontiguousarray(array, float)
            if array.size != np.prod(shape):
                raise ValueError(f"{name} has the shape {array.shape}, {shape} is needed")
            arrays.append(array.reshape(shape))
        if len(given) not in (0, len(t)):
            raise ValueError(f"{len(given)} resets are given for {len(t)} samples; give one row per sample")
        return tuple(arrays)


def _check_steps(t: Array, h_max: float) -> None:
    """Times rise, and the sub-steps can be counted."""
    if len(t) == 0 or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        raise ValueError("the times must be finite and rise from sample to sample, and there must be one at least")
    if not (np.isfinite(h_max) and h_max >= 0) or (h_max and (t[-1] - t[0]) / h_max > MOST_SUB_STEPS):
        raise ValueError(f"h_max = {h_max} s gives no usable sub-steps; give 0, or more than a billionth of the record")
