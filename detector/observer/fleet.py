"""Many calibrated observers at once, a sample of each at a time: the same numbers as one by one, several times faster.

The state is a table with a row for each valve, and a step of all of them is one compiled loop over the rows. Screen,
filter, step and law of b1 are the functions that one observer uses; what a calibrated observer does not have
(networks, adapted alphas) is left out. What depends on the time step alone (decays, filter gain) is stored in the row,
and computed again when the time step changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from detector.arithmetic.native import native
from detector.observer.alarm_rule import ABSOLUTE
from detector.observer.calibration import Calibration
from detector.observer.kernel import adapts, decays, decided, next_b1
from detector.observer.projection import RADIAL
from detector.observer.screening import GAP, USED, screened
from detector.observer.smooth_sign import SAT
from detector.observer.velocity import steady_gain_at, track
from recordings import Array, BadInput, Integers

(XI1, XI2, X1, X2, U, B1, RHO, SETTLED, COUNT, ALARM, PUSH, TIME, LAST, RUNNING, OUTLIERS, STEP, DECAY1, MEAN1, DECAY2,
 MEAN2, PER_S, RAMP, GAIN0, GAIN1, GAIN2, WIDTH) = range(26)  # fmt: skip
"""Columns of the state: the observer's; PUSH of the velocity filter; TIME to OUTLIERS of the screen; STEP
and what was computed for it."""

(A1, A4, A5, K1, K2, DELTA, DEAD_ZONE, GAIN, MOST_B1, SETTLE, CONSECUTIVE, GAP_S, TOP_SPEED, NOMINAL) = range(14)
"""Columns of the constants."""


class FleetDecisions(NamedTuple):
    """The decisions on one sample of each valve: xi2, rho [span/s], alarm, verdict, each (n_valves,)."""

    xi2: Array
    rho: Array
    alarm: NDArray[np.bool_]
    verdict: Integers


class Fleet:
    """Observers of many valves, each as `Calibration.observer` has it.

    The samples come in the observer's units, as `Calibration.scaled` makes them. Raises BadInput for none.
    """

    def __init__(self, calibrations: Sequence[Calibration]) -> None:
        if not calibrations:
            raise BadInput("fleet", "it has no valve", "give one calibration at least")
        self._constants = np.array([_constants(one) for one in calibrations])
        self._gains = np.array([one.velocity.gains for one in calibrations])
        self._initial = np.zeros((len(calibrations), WIDTH))
        self._initial[:, B1] = [one.b1 for one in calibrations]

    def initial(self) -> Array:
        """The state before the first sample, (n_valves, n_numbers)."""
        return self._initial.copy()

    def step(self, state: Array, time_s: Array, position: Array, input: Array) -> tuple[Array, FleetDecisions]:
        """One sample of each valve, each argument (n_valves,)."""
        after, verdict = np.empty_like(state), np.empty(len(state), np.int64)
        advance_fleet(state, after, self._constants, self._gains, time_s, position, input, verdict)
        return after, FleetDecisions(after[:, XI2], after[:, RHO], after[:, ALARM] > 0.0, verdict)


def _constants(one: Calibration) -> tuple[float, ...]:
    """A row of the constants."""
    n, screening = one.observer.numbers, one.observer.screening
    return (
        one.alpha1, one.alpha4, one.alpha5, n.k1, n.k2, n.delta, n.dead_zone,
        n.weight_gain, n.bound_b1, n.settle_s, n.consecutive, screening.gap_s, screening.top_speed, one.dt_s,
    )  # fmt: skip


@native
def advance_fleet(
    s: Array, new: Array, c: Array, gains: Array, time: Array, position: Array, u: Array, verdict: Integers
) -> None:
    """One sample of every valve. s, new (n_valves, WIDTH) : state before and after; c : constants."""
    for i in range(s.shape[0]):
        x, v = position[i], u[i]
        for row in range(WIDTH):
            new[i, row] = s[i, row]
        verdict[i], dt, seen = screened(
            time[i], x, v, 0.0, USED, True, (s[i, TIME], s[i, LAST], s[i, RUNNING], s[i, OUTLIERS]),
            c[i, GAP_S], c[i, TOP_SPEED],
        )  # fmt: skip
        new[i, TIME], new[i, LAST], new[i, RUNNING], new[i, OUTLIERS] = seen
        if verdict[i] > GAP:
            continue
        if dt != s[i, STEP]:
            new[i, STEP] = dt
            f = decays(dt, c[i, A1], c[i, K1], c[i, K2])
            new[i, DECAY1], new[i, MEAN1], new[i, DECAY2], new[i, MEAN2], new[i, PER_S], new[i, RAMP] = f
            new[i, GAIN0], new[i, GAIN1], new[i, GAIN2] = steady_gain_at(dt, c[i, NOMINAL], gains[i])
        f = (new[i, DECAY1], new[i, MEAN1], new[i, DECAY2], new[i, MEAN2], new[i, PER_S], new[i, RAMP])
        gain = (new[i, GAIN0], new[i, GAIN1], new[i, GAIN2])
        x1, x2, push = track(s[i, X1], s[i, X2], s[i, PUSH], dt, x, gain)
        phi = max(s[i, B1], 0.0)
        xi1, xi2, rho, settled, count, alarm, _ = decided(
            s[i, XI1], s[i, XI2], s[i, X1], s[i, X2], s[i, U], c[i, A1], c[i, A4], c[i, A5], x1, x2, v, phi,
            s[i, SETTLED], s[i, COUNT], s[i, ALARM], dt, f,
            c[i, K2], c[i, DELTA], SAT, ABSOLUTE, c[i, SETTLE], c[i, CONSECUTIVE], 0.0,
        )  # fmt: skip
        new[i, XI1], new[i, XI2], new[i, X1], new[i, X2], new[i, U], new[i, PUSH] = xi1, xi2, x1, x2, v, push
        new[i, RHO], new[i, SETTLED], new[i, COUNT], new[i, ALARM] = rho, settled, count, alarm
        if dt > 0.0 and adapts(xi2, rho, alarm, c[i, DEAD_ZONE], 1.0):
            new[i, B1] = next_b1(s[i, B1], xi2, dt * c[i, GAIN], 0.0, c[i, MOST_B1], RADIAL)
