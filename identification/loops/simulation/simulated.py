"""Simulated loops whose cause of oscillation is known: sticky valves, backlash, tight tuning, disturbances.

A sticking valve is an element of Kano or of He, or a LuGre stem of our physics, without a positioner or behind ours.
Other valves have no friction, or so little of it that no loop oscillates by it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, get_args

import numpy as np

from identification.loops.loop import LOOP_KINDS, ControlLoop, LoopKind, loop_of
from identification.loops.simulation.stem import PositionedStem, StickingStem
from identification.loops.sticking.models import StickingValve
from recordings import Array

Cause = Literal["stiction", "tuning", "disturbance", "backlash", "noise"]
CAUSES: tuple[Cause, ...] = get_args(Cause)
ValveModelName = Literal["kano", "he", "stem", "positioned"]
VALVES: tuple[ValveModelName, ...] = get_args(ValveModelName)
SHARES = (0.3, 0.2, 0.25, 0.25)
"""How often a loop has which of them."""

DT = {"flow": 1.0, "pressure": 2.0, "level": 5.0, "temperature": 10.0}
"""Sampling time by kind of loop [s]."""
WARM = 400
"""Samples before those that are kept."""
SLIGHT = (0.02, 0.2)
"""S of a valve that does not make its loop oscillate [% of OP]."""


@dataclass(frozen=True)
class SimulatedLoop:
    """A loop and what makes it oscillate. s, j : of the valve in % of OP; noise : standard deviation on PV in %;
    valve : which model; place (n,) : of the valve, % of its travel; gain : of the process, PV per % of travel; stem :
    where the valve is one of our physics.
    """

    loop: ControlLoop
    cause: Cause
    s: float
    j: float
    noise: float
    valve: ValveModelName
    place: Array
    gain: float
    stem: StickingStem | None = None

    @property
    def moves(self) -> int:
        """How often the valve turned."""
        way = np.sign(np.diff(self.place)[np.abs(np.diff(self.place)) > 1e-3 * max(self.s, 1e-3)])
        return int(np.count_nonzero(np.diff(way)))


class SteppedValve(Protocol):
    """A valve that is stepped sample by sample, OP and place in % about their middle."""

    def move(self, op: float) -> float:
        """The place for the next controller output."""


def simulated_loop(
    seed: int, cause: Cause | None = None, kind: LoopKind | None = None, valve: ValveModelName | None = None
) -> SimulatedLoop:
    """The loop of a seed: kind, process, tuning, noise, set point, valve and cause are drawn from it. A PI controller,
    PV and OP in %.
    """
    rng = np.random.default_rng([seed, 26])
    kind = LOOP_KINDS[int(rng.integers(4))] if kind is None else kind
    drawn = CAUSES[int(rng.choice(5, p=(0.4, 0.2, 0.2, 0.1, 0.1)))]
    cause = drawn if cause is None else cause
    n = int(rng.integers(900, 2200))
    integrating = kind == "level"
    tau, delay = _process(kind, rng)
    gain = 10 ** rng.uniform(-0.2, 0.3)
    tuning = _tuning(integrating, gain, tau, delay, cause, rng)
    s, j = _friction(cause, rng)
    noise = float(10 ** rng.uniform(-2.0, -0.7)) * max(s, 1.0) / 2
    outside = _disturbance(cause, n + WARM, delay + tau, rng)
    sensor = rng.normal(0, noise, n + WARM)
    more = np.random.default_rng([seed, 33])
    setpoint = _setpoint(n + WARM, more)
    valve = VALVES[int(more.choice(len(VALVES), p=SHARES))] if valve is None else valve
    stepped, s, j = _valve(valve, cause, s, j, DT[kind], more)
    signals = _run(integrating, (gain, tau, delay), tuning, stepped, setpoint, outside, sensor)
    t = np.arange(float(n)) * DT[kind]
    sp, pv, op, place = (values[WARM:] for values in (setpoint, *signals))
    loop = loop_of(f"seed {seed}", t, 50.0 + sp, 50.0 + pv, 50.0 + op, True, kind)
    return SimulatedLoop(
        loop, cause, s, j, noise, valve, place, gain, stepped if isinstance(stepped, StickingStem) else None
    )


def _setpoint(n: int, rng: np.random.Generator) -> Array:
    """A constant set point in six loops of ten, else steps."""
    if rng.uniform() < 0.6:
        return np.zeros(n)
    each = int(rng.integers(150, 600))
    return np.asarray(np.repeat(rng.uniform(-5, 5, n // each + 1), each)[:n], float)


def _valve(
    valve: ValveModelName, cause: Cause, s: float, j: float, dt: float, rng: np.random.Generator
) -> tuple[SteppedValve, float, float]:
    """The valve, and its S and J [% of OP], which a positioner hides. A stem slides, so its J is at most half of S."""
    if cause == "backlash":
        return StickingValve(s, j), s, j
    if cause != "stiction":
        s = float(rng.uniform(*SLIGHT))
        j = s * rng.uniform(0.1, 0.5)
    if valve in ("stem", "positioned"):
        j = s * rng.uniform(0.1, 0.5)
        stem = StickingStem.of(s, j, rng)
        return (stem if valve == "stem" else PositionedStem.of(stem, dt)), s, j
    return StickingValve(s, j, valve == "he"), s, j


def _process(kind: LoopKind, rng: np.random.Generator) -> tuple[float, int]:
    """Time constant and delay [samples]."""
    if kind == "flow":
        return float(rng.uniform(0.5, 4.0)), int(rng.integers(1, 4))
    if kind == "level":
        return float(rng.uniform(30.0, 120.0)), int(rng.integers(1, 3))
    return float(rng.uniform(5.0, 20.0)), int(rng.integers(1, 8))


def _tuning(
    integrating: bool, gain: float, tau: float, delay: int, cause: Cause, rng: np.random.Generator
) -> tuple[float, float]:
    """Gain and integral time [samples]: internal model control, or so tight that the loop oscillates by itself."""
    tight = cause == "tuning"
    dead = delay + 0.5
    if integrating:
        closed = rng.uniform(4, 10) * dead
        kc, ti = tau / gain * (2 * closed + dead) / (closed + dead) ** 2, 2 * closed + dead
        return (kc * rng.uniform(0.5, 1.0), ti / rng.uniform(12, 20)) if tight else (kc, ti)
    closed = rng.uniform(1.0, 3.0) * max(dead, 0.2 * tau)
    kc, ti = tau / gain / (closed + dead), max(tau, 1.0)
    return (
        (1.57 * (tau + dead / 2) / gain / dead * rng.uniform(0.82, 0.95), ti * rng.uniform(1.5, 3))
        if tight
        else (kc, ti)
    )


def _friction(cause: Cause, rng: np.random.Generator) -> tuple[float, float]:
    if cause == "stiction":
        s = float(rng.uniform(1.0, 8.0))
        return s, float(s * rng.uniform(0.15, 1.0))
    return (float(rng.uniform(0.5, 5.0)), 0.0) if cause == "backlash" else (0.0, 0.0)


def _disturbance(cause: Cause, n: int, time: float, rng: np.random.Generator) -> Array:
    """What acts on PV from outside: a weak random walk around zero, and a sine or a filtered one as the cause."""
    drift, level = rng.normal(0, 0.03, n), 0.0
    walk = np.empty(n)
    for k in range(n):
        level = 0.98 * level + drift[k]
        walk[k] = level
    if cause != "disturbance":
        return walk
    period = rng.uniform(15, 60) + 2 * time
    phase = np.cumsum(2 * np.pi / period * (1 + rng.normal(0, 0.05, n)))
    harmonic = rng.uniform(0.0, 0.2)
    return np.asarray(walk + rng.uniform(1, 4) * (np.sin(phase) + harmonic * np.sin(2 * phase + 1)), float)


def _run(
    integrating: bool,
    process: tuple[float, float, int],
    tuning: tuple[float, float],
    valve: SteppedValve,
    setpoint: Array,
    outside: Array,
    sensor: Array,
) -> tuple[Array, Array, Array]:
    """PV, OP and the place of the valve [%], (n,), about their middle."""
    (gain, tau, delay), (kc, ti), n = process, tuning, len(outside)
    pole = 1.0 if integrating else float(np.exp(-1 / tau))
    entry = gain / tau if integrating else gain * (1 - pole)
    pv, op, places = np.empty(n), np.empty(n), np.zeros(n + delay)
    state, integral = 0.0, 0.0
    for k in range(n):
        state = pole * state + entry * places[k]
        pv[k] = state + outside[k] + sensor[k]
        error = setpoint[k] - pv[k]
        integral = float(np.clip(integral + kc / ti * error, -50.0, 50.0))
        op[k] = np.clip(kc * error + integral, -50.0, 50.0)
        places[k + delay] = valve.move(float(op[k]))
    return pv, op, places[delay:]
