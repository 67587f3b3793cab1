"""Learned dynamics of positioner and servomotor: the position that set point and pressures lead to, run in parallel.

A reduced model of the drive (`kernel`) whose constants are fitted to fault-free data from name-plate values. The
model never sees the measured position after its start, so a slow fault cannot hide in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from detector.generators.contract import Generator
from detector.generators.drive import kernel
from detector.generators.drive.waves import Waves, learn_waves
from recordings import Array, BadInput

NAMEPLATE = {
    "gain": 95.0, "dead": 0.45, "fill": 0.95, "vent": 0.55, "spring": 80e3, "preload": 20e3, "plug": 0.068,
    "play": 0.008, "damp": 2000.0, "volume": 4.8, "lag": 0.3, "leak": 0.0, "supply": 600e3, "recovery": 1.0,
    "friction": 1000.0, "scale": 1.0, "offset": 0.0,
}  # fmt: skip
"""Where a fit starts: bench set 20 to 100 kPa, supply 600 kPa, and round numbers for the rest."""

_SCALE = np.array([10, 0.05, 0.05, 0.05, 4e3, 2e3, 3e-3, 4e-3, 500, 0.5, 0.03, 1e-6, 2e4, 0.05, 1e3, 2e-3, 2e-3])
"""How far a constant may be from the name plate: the unit in which it is fitted, with a prior of that width."""

_LEAST = np.array([5, 0.05, 0.1, 0.1, 1e4, 0, 0, 1e-3, 200, 0.5, 0.05, 0, 1e5, 0.3, 0, 0.5, -0.2])
_FITTED = np.arange(15)
"""A scale or an offset of the sensor cannot be told from the rest while nothing has changed; they stay."""

ServoChange = Mapping[str, tuple[float, float]]
"""What a fault does to constants, by symbol: a factor on it and a shift after that."""

CHANGES: Mapping[str, ServoChange] = {
    "relay": {"fill": (1.5, 0.0), "vent": (1.5, 0.0)},
    "gain": {"gain": (0.7, 0.0)},
    "supply": {"supply": (0.5, 0.0)},
    "vent": {"vent": (1.2, 0.0)},
    "spring": {"spring": (0.8, 0.0), "preload": (0.8, 0.0)},
    "area": dict.fromkeys(("spring", "preload", "plug", "friction"), (1.25, 0.0)),
    "plug": {"plug": (1.2, 0.0)},
    "leak": {"leak": (1.0, 3e-5)},
    "play": {"play": (1.0, 0.05)},
    "friction": {"friction": (1.0, 2000.0)},
    "scale": {"scale": (1.05, 0.0)},
    "offset": {"offset": (1.0, 0.01)},
}
"""Changes of the drive that faults bring about, each of a size that shows: its answer is what is looked for."""


@dataclass(frozen=True)
class Servo(Generator):
    """X - X^, the model X^ running in parallel at `steps` a second. Inputs: CV [1] and P1 - P2 [Pa]; output: X [1].

    constants : in the order of `SYMBOLS`; noise : standard deviation of the residual without a fault [1]. One reading
    a second.
    """

    constants: tuple[float, ...] = tuple(NAMEPLATE.values())
    noise: float = 1.0
    waves: Waves = field(default_factory=Waves)
    steps: int = 100

    @property
    def width(self) -> tuple[int, int, int]:
        """Two inputs, one output, one residual."""
        return 2, 1, 1

    def initial(self) -> Array:
        """Nothing known: the model takes its first position from the first reading."""
        return np.concatenate([np.full(kernel.STATES + 2, np.nan), self.waves.initial()])

    def position(self, state: Array, u: Array, x_first: float) -> tuple[Array, Array]:
        """State after inputs u (n, 2) and the model's positions (n,) [1]; it starts at `x_first` if it has no past."""
        waves, drop = self.waves.run(state[kernel.STATES + 2 :], u[:, 1])
        now, out = np.array(state[: kernel.STATES + 2], float), np.empty(len(u))
        if np.isnan(now).any():
            now = self._start(u[0], x_first)
        drive, past = now[: kernel.STATES].copy(), now[kernel.STATES :].copy()
        th, setpoint = np.array(self.constants), np.ascontiguousarray(u[:, 0])
        kernel.advance(drive, past, setpoint, drop, th, self.steps, out)
        return np.concatenate([drive, past, waves]), out

    def _advance(self, state: Array, u: Array, y: Array) -> tuple[Array, Array]:
        state, x = self.position(state, u, float(y[0, 0]))
        return state, y - x[:, None]

    def _start(self, u: Array, x: float) -> Array:
        """At rest at x under the first inputs."""
        th = dict(zip(kernel.SYMBOLS, self.constants, strict=True))
        x = min(max(x, 0.0), 1.0)
        need = th["preload"] + th["spring"] * x + th["plug"] * u[1] / (1 - th["recovery"] * (0.5 * x + 0.1 * x**3))
        air = (need / 101325.0 + 1) * (th["volume"] + x)
        return np.array([u[0], u[0], air, x, x, 0.0, u[0], 0.0])

    def answers(self, u: Array, x_first: float) -> Array:
        """What each of `CHANGES` would add to the position [1], from the start on, (n, n_changes)."""
        nominal = self.position(self.initial(), u, x_first)[1]
        moved = (self._changed(change).position(self.initial(), u, x_first)[1] for change in CHANGES.values())
        return np.column_stack([one - nominal for one in moved])

    def _changed(self, change: ServoChange) -> Servo:
        values = dict(zip(kernel.SYMBOLS, self.constants, strict=True))
        values |= {name: factor * values[name] + shift for name, (factor, shift) in change.items()}
        return replace(self, constants=tuple(values.values()))


def learn_servo(u: Array, x: Array, *, skip: int = 100, rounds: int = 20) -> Servo:
    """Fit the constants to fault-free readings, one a second: u (n, 2) as in `Servo`, x (n,) [1].

    Robust Gauss-Newton on the free-run error; `skip` readings at the start do not count. Raises BadInput for too few.
    """
    if len(x) < skip + 200 or not (np.isfinite(u).all() and np.isfinite(x).all()):
        raise BadInput("fault-free data", f"{len(x)} readings", f"give {skip + 200} finite readings at least")
    start = np.array(list(NAMEPLATE.values()))
    best = _Fit(u, x, start, skip, learn_waves(u[:, 1]))
    q, cost = np.zeros(len(_FITTED)), best.cost(np.zeros(len(_FITTED)))
    for _ in range(rounds):
        lower, q_new = best.improved(q)
        if lower > cost * (1 - 3e-4):
            break
        cost, q = lower, q_new
    return Servo(best.constants(q), float(np.std(best.errors(q))), best.waves)


@dataclass(frozen=True, eq=False)
class _Fit:
    """The least-squares problem in units of `_SCALE`."""

    u: Array
    x: Array
    start: Array
    skip: int
    waves: Waves
    unit: float = 1.5e-3

    def constants(self, q: Array) -> tuple[float, ...]:
        th = self.start.copy()
        th[_FITTED] += _SCALE[_FITTED] * q
        return tuple(np.maximum(th, _LEAST).tolist())

    def errors(self, q: Array) -> Array:
        servo = Servo(self.constants(q), waves=self.waves)
        error = self.x - servo.position(servo.initial(), self.u, float(self.x[0]))[1]
        return np.nan_to_num(error[self.skip :], nan=1.0)

    def cost(self, q: Array) -> float:
        r = np.abs(self.errors(q)) / self.unit
        return float(np.where(r < 6, r * r, 12 * r - 36).sum() + q @ q)

    def improved(self, q: Array, h: float = 0.3) -> tuple[float, Array]:
        """The best of some damped Gauss-Newton steps."""
        r = self.errors(q) / self.unit
        axes = h * np.eye(len(q))
        slopes = np.column_stack([(self.errors(q + e) - self.errors(q - e)) / (2 * h * self.unit) for e in axes])
        weight = 1 / np.maximum(1.0, np.abs(r) / 6)
        gradient, curvature = slopes.T @ (weight * r) + q, (slopes * weight[:, None]).T @ slopes
        tries = [q - np.linalg.solve(curvature + np.eye(len(q)) * mu, gradient) for mu in (1.0, 10.0, 100.0, 1e3, 1e4)]
        costs = [self.cost(one) for one in tries]
        least = int(np.argmin(costs))
        return costs[least], tries[least]
