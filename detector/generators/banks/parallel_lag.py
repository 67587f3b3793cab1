"""A positioner and its valve as a curve, a lag and two limits of speed, learned from data and run in parallel."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from detector.arithmetic.native import native
from recordings import Array, BadInput

_CURVE = 5
_STATES = 4


@dataclass(frozen=True, eq=False)
class ParallelLag:
    """X^ from CV and the pressure drop alone, a reading a second: a target c(CV) + drop_effect (drop - 1), approached
    by a lag [s] within two limits of speed [1/s], behind a play [1].

    constants (n_constants,) : lag, limits up and down, effect of the drop, play, then c at `knots`; deviation : of
    X - X^ without a fault; changes (n_constants,) : of the constants, whose answers are looked for.
    """

    knots: Array
    constants: Array
    deviation: float = 1.0
    changes: Array = field(default_factory=lambda: _CHANGES)

    @property
    def constants_count(self) -> int:
        """Number of answers, with that of a constant offset."""
        return len(self.constants) + 1

    def initial(self) -> Array:
        """Unknown: it takes its first position from the first reading. One state for each changed model."""
        return np.full(_STATES * (len(self.constants) + 1), np.nan)

    def position(self, state: Array, u: Array, first: float) -> tuple[Array, Array]:
        """State (4,) after inputs u (n, 2), and positions (n,)."""
        now, out = np.array(state, float), np.empty(len(u))
        if np.isnan(now).any():
            now = np.array([first, first, u[0, 0], u[0, 1]])
        target = np.ascontiguousarray(np.interp(u[:, 0], self.knots, self.constants[5:]))
        before = float(np.interp(now[2], self.knots, self.constants[5:]))
        _follow(now, before, target, np.ascontiguousarray(u[:, 1]), self.constants[:5], out)
        now[2], now[3] = u[-1]
        return now, out

    def answers(self, state: Array, u: Array, x: Array) -> tuple[Array, Array, Array]:
        """State after rows u (n, 2), x (n,); (X - X^) / deviation (n,); what a change of each constant adds to X^, and
        an offset, over the deviation (n, n_constants + 1).
        """
        states, first = state.reshape(-1, _STATES), float(x[0])
        after, runs = zip(
            *(one.position(part, u, first) for one, part in zip(self._models(), states, strict=True)), strict=True
        )
        answers = np.column_stack([run - runs[0] for run in runs[1:]] + [np.full(len(x), 1e-2)])
        return np.concatenate(after), (x - runs[0]) / self.deviation, answers / self.deviation

    def _models(self) -> list[ParallelLag]:
        moved = self.constants + np.diag(self.changes[: len(self.constants)])
        return [self, *(replace(self, constants=one) for one in moved)]


_CHANGES: Array = np.array([0.5, 0.02, -0.02, 0.02, 0.01, *[0.01] * _CURVE])


@native
def _follow(now: Array, before: float, target: Array, drop: Array, th: Array, out: Array) -> None:
    """Readings k - 1 to k in four steps, the set point straight between them."""
    dt = 1.0 / 4
    share = 1.0 - np.exp(-dt / max(th[0], 1e-3))
    for k in range(target.shape[0]):
        for j in range(4):
            part = (j + 1.0) * dt
            goal = before + (target[k] - before) * part
            goal += th[3] * (now[3] + (drop[k] - now[3]) * part - 1.0)
            move = share * (goal - now[0])
            now[0] += min(max(move, -abs(th[2]) * dt), abs(th[1]) * dt)
            half = 0.5 * abs(th[4])
            now[1] = min(max(now[1], now[0] - half), now[0] + half)
            now[1] = min(max(now[1], 0.0), 1.0)
        before, now[3] = target[k], drop[k]
        out[k] = now[1]


def learn_parallel_lag(u: Array, x: Array) -> ParallelLag:
    """Fit to fault-free rows u (n, 2), x (n,) by robust least squares on the free run. Raises BadInput for too few."""
    from scipy.optimize import least_squares

    if len(x) < 500 or not (np.isfinite(u).all() and np.isfinite(x).all()):
        raise BadInput("parallel model", f"{len(x)} readings", "give 500 finite readings at least")
    knots = np.linspace(float(u[:, 0].min()), float(u[:, 0].max()) + 1e-9, _CURVE)
    straight = np.polyfit(u[:, 0], x, 1)
    start = np.array([1.0, 0.2, 0.2, 0.0, 0.01, *np.polyval(straight, knots)])
    low = np.array([0.05, 0.005, 0.005, -1.0, 0.0, *[-0.5] * _CURVE])
    high = np.array([60.0, 5.0, 5.0, 1.0, 0.2, *[1.5] * _CURVE])

    def errors(constants: Array) -> Array:
        model = ParallelLag(knots, constants)
        run = model.position(np.full(_STATES, np.nan), u, float(x[0]))[1]
        return np.asarray((x - run)[100:], np.float64)

    tried = [start.copy() for _ in range(3)]
    tried[1][:3], tried[2][:3] = (0.3, 0.1, 0.1), (5.0, 1.0, 1.0)
    scale = np.array([1.0, 0.1, 0.1, 0.1, 0.01, *[0.1] * _CURVE])
    fits = [
        least_squares(errors, np.clip(one, low, high), bounds=(low, high), x_scale=scale, loss="soft_l1", f_scale=5e-3,
                      diff_step=1e-3)
        for one in tried
    ]  # fmt: skip
    best = min(fits, key=lambda one: one.cost).x
    return ParallelLag(knots, best, max(float(np.std(errors(best))), 1e-6))
