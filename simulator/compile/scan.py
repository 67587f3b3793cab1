"""Run a recurrence over a recording, with forward sensitivities, as fast as the machine allows.

Where a C compiler is found its expressions become C, compiled and cached (`c_loop`); where there is none, numba
compiles the same operations from Python (`numba_loop`). Both ways give the same numbers.
"""

from __future__ import annotations

import ctypes
import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from recordings import Array
from simulator.compile import c_loop
from simulator.compile.c_compiler import compiler
from simulator.compile.recurrence import Loops, Recurrence

MOST_SUB_STEPS = 10**9
"""A run that needs more is refused: it would take the better part of an hour."""


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


class Run(NamedTuple):
    """What one of several runs is given: t, u, s0, hold and resets as in `Scanner.run`."""

    t: Array
    u: Array
    s0: Array
    hold: bool = False
    resets: Array | None = None


class Scanner:
    """A recurrence ready to run: `Scanner(recurrence).run(t, u, p, s0)`; safe to use from several threads.

    Raises NotImplementedError for an operation that needs a C compiler where there is none.
    """

    def __init__(self, recurrence: Recurrence) -> None:
        self.recurrence = recurrence
        self.sizes = recurrence.sizes
        self._loops: dict[bool, Loops] = {}
        self._compiled = compiler() is not None
        if not self._compiled:
            self._loops = dict.fromkeys((False, True), self._without_compiler())
        self._libraries: dict[tuple[str, tuple[int, ...]], ctypes.CDLL | None] = {}
        self._on_lanes: dict[tuple[int, ...], ctypes.CDLL | None] = {}
        ns, np_ = self.sizes.states, self.sizes.parameters
        self._unit, self._none = np.hstack([np.zeros((ns, np_)), np.eye(ns)]), np.zeros((0, ns))
        self._lock = threading.Lock()

    def compiled_with(self, text: str, columns: tuple[int, ...]) -> ctypes.CDLL | None:
        """A library of C text that calls what `parts.h` and `shots.h` have, with derivatives by some of the parameters;
        None where it cannot be compiled. Kept for this process.
        """
        with self._lock:
            if self._compiled and (text, columns) not in self._libraries:
                self._libraries[text, columns] = c_loop.with_shots(self.recurrence, columns, text)
            return self._libraries.get((text, columns))

    @property
    def compiled(self) -> bool:
        """Whether a C compiler makes the machine code (True) or numba."""
        self._loops_for(False)
        return self._compiled

    def _loops_for(self, sensitive: bool) -> Loops:
        """The loops with derivatives or without, compiled when first asked for: many kernels need one of them."""
        if loops := self._loops.get(sensitive):
            return loops
        with self._lock:
            if sensitive not in self._loops:
                made = c_loop.loops(self.recurrence, sensitive) if self._compiled else None
                self._compiled = made is not None
                self._loops[sensitive] = made or self._without_compiler()
            return self._loops[sensitive]

    def _without_compiler(self) -> Loops:
        from simulator.compile import numba_loop  # numba is slow to import and most machines have a compiler

        of = self.recurrence
        return numba_loop.loops(of.functions(), self.sizes.exo, of.scale, of.ahead)

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
        states after a sample's output, NaN where a state goes on; sensitivities of position and velocity become zero.
        Raises ValueError for shapes that do not fit, times that do not rise and a useless h_max.
        """
        if sensitivities:
            self._check_derivatives()
        t, u, p, s, given = self._checked(t, u, p, s0, resets)
        _check_steps(t, h_max)
        _, _, np_, ny, _ = self.sizes
        columns = self._unit.copy()
        ns = len(columns)
        y, jacobian = np.zeros((len(t), ny)), np.zeros((len(t) if sensitivities else 0, ny, np_ + ns))
        failed = self._loops_for(sensitivities).scan(t, u, hold, h_max, p, s, y, columns, jacobian, given)
        if failed >= 0:
            y[failed:], jacobian[failed:], s[:], columns[:] = np.nan, np.nan, np.nan, np.nan
        derivatives = (jacobian, columns) if sensitivities else (None, None)
        return Scan(y, s, failed if failed >= 0 else None, *derivatives)

    def run_together(
        self, runs: Sequence[Run], p: Array, columns: tuple[int, ...], *, h_max: float = 0.0
    ) -> list[tuple[Array, Array]] | None:
        """Several runs at once, six in a quarter of their time where vectors hold eight numbers. Of each the outputs
        (n_samples, n_outputs), and their derivatives (n_samples, n_outputs, n_columns + n_states) by these of the
        parameters and the initial state. None where one of them fails (`run` tells which).

        Raises ValueError as `run` does. Runs that cannot be made together are made one after the other: without a C
        compiler, and where an operation has no translation.
        """
        self._check_derivatives()
        library = self._scan_on_lanes(columns) if len(runs) > 1 else None
        if library is None:
            return self._one_by_one(runs, p, columns, h_max)
        found, segments, kept = [], (c_loop.SEGMENT * len(runs))(), []
        for segment, given in zip(segments, runs, strict=True):
            t, u, _, s0, resets = self._checked(given.t, given.u, p, given.s0, given.resets)
            _check_steps(t, h_max)
            ny, width = self.sizes.outputs, len(columns) + self.sizes.states
            found.append((np.empty((len(t), ny)), np.empty((len(t), ny, width))))
            arrays = {"t": t, "u": u, "resets": resets, "s": s0, "y": found[-1][0], "Y": found[-1][1]}
            kept.append(arrays)
            for name, array in arrays.items():
                setattr(segment, name, array.ctypes.data if array.size else None)
            segment.n, segment.hold = len(t), given.hold
        p = np.ascontiguousarray(p, float)
        lanes = library.lanes()
        for first in range(0, len(runs), lanes):
            count = min(len(runs) - first, lanes)
            if not library.scan_lanes(count, ctypes.byref(segments[first]), h_max, p.ctypes.data):
                return None
        return found

    def _one_by_one(
        self, runs: Sequence[Run], p: Array, columns: tuple[int, ...], h_max: float
    ) -> list[tuple[Array, Array]] | None:
        kept, found = [*columns, *range(len(p), len(p) + self.sizes.states)], []
        for given in runs:
            t, u, s0, hold, resets = given
            run = self.run(t, u, p, s0, h_max=h_max, hold=hold, sensitivities=True, resets=resets)
            if run.failed is not None or run.jacobian is None:
                return None
            found.append((run.outputs, run.jacobian[:, :, kept]))
        return found

    def _scan_on_lanes(self, columns: tuple[int, ...]) -> ctypes.CDLL | None:
        with self._lock:
            if self._compiled and columns not in self._on_lanes:
                self._on_lanes[columns] = c_loop.scan_on_lanes(self.recurrence, columns)
            return self._on_lanes.get(columns)

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
        failed = self._loops_for(carried is None).shoot(0, n, t, u, h_max, p, path, ends, by, y, y_by, mask)
        return Shots(ends, by, y, y_by, failed if failed >= 0 else None)

    def _check_derivatives(self) -> None:
        if not self.recurrence.differentiable:
            raise ValueError("sensitivities are asked for, and the recurrence was built without (differentiable=False)")

    def _checked(self, t: Array, u: Array, p: Array, s0: Array, resets: Array | None) -> tuple[Array, ...]:
        """The arguments as contiguous arrays of the shapes the loop expects; the state is a copy."""
        ns, _, np_, _, nu = self.sizes
        t = np.ascontiguousarray(t, float).reshape(-1)
        given = self._none if resets is None else _shaped("resets", resets, (len(resets), ns))
        if len(given) not in (0, len(t)):
            raise ValueError(f"{len(given)} resets are given for {len(t)} samples; give one row per sample")
        s0 = _shaped("s0", np.array(s0, float), (ns,))
        return t, _shaped("u", u, (len(t), nu)), _shaped("p", p, (np_,)), s0, given


def _shaped(name: str, array: Array, shape: tuple[int, ...]) -> Array:
    """An array as the loop takes it: contiguous, of a shape. Raises ValueError for another number of values."""
    array = np.ascontiguousarray(array, float)
    if array.shape == shape:
        return array
    if array.size != math.prod(shape):
        raise ValueError(f"{name} has the shape {array.shape}, {shape} is needed")
    return array.reshape(shape)


def _check_steps(t: Array, h_max: float) -> None:
    """Times rise, and the sub-steps can be counted."""
    if len(t) == 0 or not (t[1:] > t[:-1]).all() or not (math.isfinite(t[0]) and math.isfinite(t[-1])):
        raise ValueError("the times must be finite and rise from sample to sample, and there must be one at least")
    if not (math.isfinite(h_max) and h_max >= 0) or (h_max and (t[-1] - t[0]) / h_max > MOST_SUB_STEPS):
        raise ValueError(f"h_max = {h_max} s gives no usable sub-steps; give 0, or more than a billionth of the record")
