"""Simulated loops whose cause of oscillation is known: sticky valves, backlash, tight tuning, disturbances."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from identification.loops.loop import LOOP_KINDS, ControlLoop, LoopKind, loop_of
from identification.loops.stiction_models import KanoValve
from recordings import Array

Cause = Literal["stiction", "tuning", "disturbance", "backlash", "noise"]
CAUSES: tuple[Cause, ...] = get_args(Cause)

DT = {"flow": 1.0, "pressure": 2.0, "level": 5.0, "temperature": 10.0}
"""Sampling time by kind of loop [s]."""


@dataclass(frozen=True)
class SimulatedLoop:
    """A loop and what makes it oscillate. s, j : of the valve in % of OP; noise : standard deviation on PV in %."""

    loop: ControlLoop
    cause: Cause
    s: float
    j: float
    noise: float


def simulated_loop(seed: int, cause: Cause | None = None, kind: LoopKind | None = None) -> SimulatedLoop:
    """The loop of a seed: kind, process, tuning, noise and cause are drawn from it. A PI controller, PV and OP in %."""
    rng = np.random.default_rng([seed, 26])
    kind = LOOP_KINDS[int(rng.integers(4))] if kind is None else kind
    drawn = CAUSES[int(rng.choice(5, p=(0.4, 0.2, 0.2, 0.1, 0.1)))]
    cause = drawn if cause is None else cause
    n, warm = int(rng.integers(900, 2200)), 400
    integrating = kind == "level"
    tau, delay = _process(kind, rng)
    gain = 10 ** rng.uniform(-0.2, 0.3)
    kc, ti = _tuning(integrating, gain, tau, delay, cause, rng)
    s, j = _valve(cause, rng)
    noise = float(10 ** rng.uniform(-2.0, -0.7)) * max(s, 1.0) / 2
    outside = _disturbance(cause, n + warm, delay + tau, rng)
    pv, op = _run(n + warm, integrating, (gain, tau, delay), (kc, ti), (s, j), noise, outside, rng)
    t = np.arange(float(n)) * DT[kind]
    loop = loop_of(f"seed {seed}", t, np.full(n, 50.0), pv[warm:], op[warm:], True, kind)
    return SimulatedLoop(loop, cause, s, j, noise)


def as_kept(loop: ControlLoop, seed: int) -> ControlLoop:
    """The loop as the historian of a seed keeps it: as it is (three of five), quantised, or compressed."""
    rng = np.random.default_rng([seed, 28])
    how, size = rng.uniform(), 10 ** rng.uniform(-1.5, 0.0) * float(np.std(loop.pv))
    if how < 0.6:
        return loop
    return quantised(loop, size / 2) if how < 0.8 else compressed(loop, size)


def quantised(loop: ControlLoop, step: float) -> ControlLoop:
    """The loop as a transmitter or a historian keeps it that rounds PV to whole steps, in the unit of PV."""
    return replace(loop, pv=np.round(loop.pv / step) * step)


def compressed(loop: ControlLoop, band: float) -> ControlLoop:
    """The loop as a historian keeps it that drops PV samples within a dead band, in the unit of PV, and repeats."""
    kept = loop.pv.copy()
    for k in range(1, len(kept)):
        if abs(loop.pv[k] - kept[k - 1]) < band:
            kept[k] = kept[k - 1]
    return replace(loop, pv=kept)


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


def _valve(cause: Cause, rng: np.random.Generator) -> tuple[float, float]:
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
    n: int,
    integrating: bool,
    process: tuple[float, float, int],
    tuning: tuple[float, float],
    band: tuple[float, float],
    noise: float,
    outside: Array,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """PV and OP [%], (n,)."""
    (gain, tau, delay), (kc, ti) = process, tuning
    valve = KanoValve(*band)
    sensor = rng.normal(0, noise, n)
    pole = 1.0 if integrating else float(np.exp(-1 / tau))
    entry = gain / tau if integrating else gain * (1 - pole)
    pv, op, places = np.empty(n), np.empty(n), np.zeros(n + delay + 1)
    state, integral, last, shaken = 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        state = pole * state + entry * places[k]
        shaken = outside[k]
        measured = state + shaken + sensor[k]
        error = -measured
        integral = float(np.clip(integral + kc / ti * error, -50.0, 50.0))
        last = float(np.clip(kc * error + integral, -50.0, 50.0))
        places[k + delay] = valve.move(last)
        pv[k], op[k] = 50.0 + measured, 50.0 + last
    return pv, op
