"""Where the stem should be by the set point alone, and how far it is from there: the loop of one valve.

The constants of the loop follow what drifts, each within one of its `CHANGES` up or down and over an hour: a fault that
moves the position by more than all of them together stays to be seen, however slowly it came.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from detector.measurements import Measurement, Measurements
from detector.watch.positioner.kernel import (
    CURVE,
    DEAD,
    DOWN,
    GAIN,
    LATE,
    LOOPS,
    N_LOOP,
    PLAY,
    PUSH,
    SINCE,
    UP,
    watch,
)
from recordings import Array, BadInput

SETPOINT, BEFORE_IT, BEHIND_IT = "setpoint", "upstream_pressure", "downstream_pressure"

CHANGES = ((GAIN, 0.3, 0.0), (UP, 0.3, 0.0), (DOWN, 0.3, 0.0), (PUSH, 0.3, 0.0), (PLAY, 0.0, 0.01), (DEAD, 0.0, 0.005),
           (LATE, 0.3, 0.0))  # fmt: skip
"""Constants that may drift, by a share of themselves and by a part of the stroke."""

OFFSET = 0.01
"""The same of the position [share of the stroke]."""

N_ANSWERS = len(CHANGES) + 1

MEMORY_S = 3600.0
"""The constants follow over so long [s]: abrupt faults take seconds, the drift of a healthy valve takes hours."""

SETTLE_SAMPLES, SETTLE_LAGS, GAP_SAMPLES = 30, 5.0, 5

BEYOND = 0.05
"""How far the set point and the pressure drop may leave the learned range, as a share of it."""


@dataclass(frozen=True)
class PositionerLoop:
    """The loop of a valve.

    constants : as `kernel.SYMBOLS` names them, then the positions of the knots; zero, span : position at which the
    learned stroke begins, and its length [m]; lowest, width : of the knots [unit of the set point]; drop, drop_span :
    usual pressure drop and its learned range [Pa], 0 where the drop is not used; setpoints, drops : learned ranges,
    the latter in shares of drop_span; deviation : usual size of the residual [share of the stroke]; powers : mean
    squares of the answers to `CHANGES` and offset, over the deviation; dt_s : sampling time [s].
    """

    constants: tuple[float, ...]
    zero: float
    span: float
    lowest: float
    width: float
    drop: float
    drop_span: float
    setpoints: tuple[float, float]
    drops: tuple[float, float]
    deviation: float
    powers: tuple[float, ...]
    dt_s: float

    @property
    def signals(self) -> tuple[str, ...]:
        """What it needs beside the position."""
        return (SETPOINT, BEFORE_IT, BEHIND_IT) if self.drop_span else (SETPOINT,)

    def initial(self) -> Array:
        """The state before the first sample: a row of numbers."""
        state = np.zeros(LOOPS + (N_LOOP + 1) * N_ANSWERS + N_ANSWERS**2)
        state[SINCE] = -1.0
        return state

    def step(self, before: Array, moment: Measurement, frozen: bool) -> tuple[Array, float]:
        """The state after a sample, and by how many usual deviations the position is from where it should be; NaN
        where that says nothing: too soon after a start or a gap, at rest, or beyond the learned set points and drops.
        frozen : the constants follow nothing.
        """
        after, row, said = before.copy(), np.empty((1, 4)), np.empty(1)
        row[0] = self._scaled(moment.time_s, moment.values)
        watch(after, row, frozen, self._models, self._numbers, self._drifts, said, np.empty((1, N_ANSWERS)))
        return after, float(said[0])

    def run(self, data: Measurements) -> tuple[Array, Array]:
        """From the start over many samples: residuals (n_samples,), NaN where they say nothing, and answers (n_samples,
        n_answers) : what each change adds, in the same unit.
        """
        rows = self.rows(data)
        residuals, answers = np.empty(len(rows)), np.zeros((len(rows), N_ANSWERS))
        watch(self.initial(), rows, False, self._models, self._numbers, self._drifts, residuals, answers)
        return residuals, answers

    def rows(self, data: Measurements) -> Array:
        """Time [s], set point, pressure drop and position of samples, (n_samples, 4), as the kernel takes them."""
        return np.column_stack(np.broadcast_arrays(*self._scaled(data.time_s, data.values)))

    def _scaled(self, time_s: Any, values: Mapping[str, Any]) -> tuple[Any, Any, Any, Any]:
        """Time, set point, drop and position as the kernel takes them, of one sample or of many."""
        drop = (values[BEFORE_IT] - values[BEHIND_IT] - self.drop) / self.drop_span if self.drop_span else 0.0
        return time_s, values[SETPOINT], drop, (values["position"] - self.zero) / self.span

    @property
    def gap_s(self) -> float:
        """A silence that is longer starts it anew [s]."""
        return max(GAP_SAMPLES * self.dt_s, 0.5)

    @cached_property
    def _models(self) -> Array:
        """The constants (n_answers, n_constants), and with each of the changes."""
        models = np.tile(np.array(self.constants), (N_ANSWERS, 1))
        for row, (place, share, part) in zip(models[1:], CHANGES, strict=True):
            row[place] += share * row[place] + part
        return models

    @cached_property
    def _numbers(self) -> Array:
        settle_s = max(SETTLE_SAMPLES * self.dt_s, SETTLE_LAGS * (self.constants[LATE] + 1.0 / self.constants[GAIN]))
        ranges = [end for low, high in (self.setpoints, self.drops) for end in _widened(low, high)]
        return np.array([self.lowest, self.width, self.gap_s, settle_s, OFFSET, self.deviation, *ranges])

    @cached_property
    def _drifts(self) -> Array:
        """Growth of the variance of the shares of the changes in a sample, (n_answers,): so that each of them alone
        would follow over `MEMORY_S`; none where the data do not show the change.
        """
        n, powers = MEMORY_S / self.dt_s, np.array(self.powers)
        return np.where(powers > 1e-3, 1.0 / np.maximum(powers, 1e-3), 0.0) / n**2

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> PositionerLoop:
        """What `as_dict` gave. Raises BadInput for constants that are none of a loop."""
        rows = {name: tuple(parts[name]) for name in ("constants", "setpoints", "drops", "powers")}
        if len(rows["constants"]) < CURVE + 2 or len(rows["powers"]) != N_ANSWERS:
            raise BadInput("learned detector", "its positioner has another form", "learn anew")
        return cls(**{**parts, **rows})


def _widened(low: float, high: float) -> tuple[float, float]:
    more = BEYOND * (high - low) + 1e-9
    return low - more, high + more
