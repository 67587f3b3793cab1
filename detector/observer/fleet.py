"""Many calibrated observers at once, a sample of each at a time: the same numbers as one by one, several times faster.

The state is a table with a row for each valve, and a step of all of them is one compiled loop over the rows. Screen,
velocity filter (the steady form), networks, step and laws are the functions that one observer uses. What depends on
the time step alone (decays, filter gain) is stored in the row, and computed again when the time step changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import fabs
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from detector.arithmetic.native import native
from detector.observer.approximators import evaluate
from detector.observer.calibration import Calibration
from detector.observer.kernel import A1, ALARM, RHO_LAST, XI2, Numbers, decays, step
from detector.observer.screening import GAP, USED, screened
from detector.observer.velocity import steady_gain_at, track
from recordings import Array, BadInput, Integers

(POSITION, SPEED, PUSH, TIME, LAST, RUNNING, OUTLIERS, STEP, RATE, DECAY1, MEAN1, DECAY2, MEAN2, PER_S, RAMP, GAIN0,
 GAIN1, GAIN2, CORE) = range(19)  # fmt: skip
"""Columns of the state: of the velocity filter; of the screen; STEP and RATE, and what was computed for them; then the
state of the observer."""

GAP_S, TOP_SPEED, NOMINAL, NUMBERS = range(4)
"""Columns of the constants; the `Numbers` of the observer follow."""


class FleetDecisions(NamedTuple):
    """The decisions on one sample of each valve: xi2, rho [span/s], alarm, verdict, each (n_valves,)."""

    xi2: Array
    rho: Array
    alarm: NDArray[np.bool_]
    verdict: Integers


class Fleet:
    """Observers of many valves, each as `Calibration.compiled` has it.

    The samples come in the observer's units, as `Calibration.scaled` makes them. Raises BadInput for none.
    """

    def __init__(self, calibrations: Sequence[Calibration]) -> None:
        if not calibrations:
            raise BadInput("fleet", "it has no valve", "give one calibration at least")
        observers = [one.compiled for one in calibrations]
        self._constants = np.array([_constants(one) for one in calibrations])
        self._gains = np.array([one.velocity.gains for one in calibrations])
        self._centres = np.array([one.centre for one in observers])
        self._bases = tuple(np.array([one.tables[k].base for one in observers]) for k in (0, 1))
        self._powers = tuple(table.powers for table in observers[0].tables)
        self._initial = np.zeros((len(calibrations), CORE + self._centres.shape[1]))
        self._initial[:, CORE:] = [one.initial().core for one in observers]

    def initial(self) -> Array:
        """The state before the first sample, (n_valves, n_numbers)."""
        return self._initial.copy()

    def step(self, state: Array, time_s: Array, position: Array, input: Array) -> tuple[Array, FleetDecisions]:
        """One sample of each valve, each argument (n_valves,)."""
        after, verdict = state.copy(), np.empty(len(state), np.int64)
        advance_fleet(
            after, self._constants, self._centres, self._gains, *self._bases, *self._powers, time_s, position, input,
            verdict,
        )  # fmt: skip
        core = after[:, CORE:]
        return after, FleetDecisions(core[:, XI2], core[:, RHO_LAST], core[:, ALARM] > 0.0, verdict)


def _constants(one: Calibration) -> tuple[float, ...]:
    """A row of the constants."""
    observer = one.compiled
    return observer.screening.gap_s, observer.screening.top_speed, one.dt_s, *observer.numbers


@native
def advance_fleet(
    s: Array, c: Array, centres: Array, gains: Array, bases1: Array, bases2: Array, powers1: Integers,
    powers2: Integers, time: Array, position: Array, u: Array, verdict: Integers,
) -> None:  # fmt: skip
    """One sample of every valve, changing the state s (n_valves, n_numbers) in place. c : constants."""
    s1, s2 = np.empty(powers1.shape[0]), np.empty(powers2.shape[0])
    values1, values2 = np.empty(bases1.shape[1]), np.empty(bases2.shape[1])
    for i in range(s.shape[0]):
        row = s[i]
        verdict[i], dt, seen = screened(
            time[i], position[i], u[i], 0.0, USED, True, (row[TIME], row[LAST], row[RUNNING], row[OUTLIERS]),
            c[i, GAP_S], c[i, TOP_SPEED],
        )  # fmt: skip
        row[TIME], row[LAST], row[RUNNING], row[OUTLIERS] = seen
        if verdict[i] > GAP:
            continue
        p = _numbers(c[i, NUMBERS:])
        core = row[CORE:]
        if dt != row[STEP] or core[A1] != row[RATE]:
            row[STEP], row[RATE] = dt, core[A1]
            f = decays(dt, core[A1], p.k1, p.k2)
            row[DECAY1], row[MEAN1], row[DECAY2], row[MEAN2], row[PER_S], row[RAMP] = f
            row[GAIN0], row[GAIN1], row[GAIN2] = steady_gain_at(dt, c[i, NOMINAL], gains[i])
        f = (row[DECAY1], row[MEAN1], row[DECAY2], row[MEAN2], row[PER_S], row[RAMP])
        gain = (row[GAIN0], row[GAIN1], row[GAIN2])
        row[POSITION], row[SPEED], row[PUSH] = track(row[POSITION], row[SPEED], row[PUSH], dt, position[i], gain)
        speed = fabs(row[SPEED])
        evaluate(bases1[i], powers1, row[SPEED], speed, values1, s1)
        evaluate(bases2[i], powers2, speed, speed, values2, s2)
        step(core, centres[i], dt, row[POSITION], row[SPEED], u[i], s1, s2, f, p)


@native
def _numbers(c: Array) -> Numbers:
    """The constants of one observer from a row."""
    return Numbers(
        c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10], c[11], c[12], c[13], c[14], c[15], c[16],
        c[17], c[18], c[19], c[20], c[21], c[22], c[23], c[24], c[25], c[26], c[27],
    )  # fmt: skip
