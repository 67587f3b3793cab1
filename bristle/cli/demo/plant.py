"""The plant of the demo: the benchmark's actuator with an isolated valve, integrated apart from everything that fits.

Its differential equations are written out once more and run by the classical Runge-Kutta scheme in steps of 50 us. So
what the demo fits and traces does not come from the scheme by which models are run. `python -m bristle.cli.demo.plant`
serves it, in lock-step.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit

from bristle.cli.plant_options import ActuatorOptions
from bristle.cli.serving import run
from hil import ActuatorPlant, RegisterMap, ServerSettings, WriteMap, listen_address
from recordings import Array, BadInput
from simulator.damadics import COLUMN, STEP, Actuator, State

FINE = 50
"""Steps of Runge-Kutta in one of 2.5 ms: the bristle swings through 0.06 rad in one of them."""
STATES = ("x", "v", "z", "q1", "q2", "air", "cvi", "tick")
"""Position [m], velocity [m/s], bristle [m], two filtered set points [1], air [kg], controller output [1], count."""
COIL = "position_periodic_force"
"""The effect that it may have beside the base."""
FRICTION = ("fc", "fs", "vs", "sigma0", "sigma1", "sigma2")
LEVER_ANGLE = np.pi / 3
PRESSURE_LIMIT = 700e3
F = TypeVar("F", bound=Callable[..., Any])


class RungeKutta(Actuator):
    """The actuator with friction as a force and, maybe, a force that repeats along the stroke.

    No flow: inlet and outlet pressure are one. No faults: friction changes by its parameters. Raises BadInput for other
    effects.
    """

    def start(self, position: float = 0.0) -> State:
        """At rest at a position [share of the stroke] with an empty chamber."""
        p = self.parameters
        if others := set(self.effects) - {"lugre", COIL}:
            raise BadInput("plant of the demo", f"it has no {', '.join(sorted(others))}", f"it can have {COIL}")
        x = position * p.stroke
        air = (p.dead_volume + p.diaphragm_area * x) * p.atmosphere / (p.gas_constant * p.gas_temperature)
        return State(0, np.array([x, 0.0, 0.0, 0.0, 0.0, air, 0.0, 0.0]), STATES)

    def _run(self, state: State, u: Array) -> tuple[Array, Array]:
        p, values = self.parameters, self.values
        coil = [values.get(f"{COIL}.{name}", neutral) for name, neutral in (("a", 0.0), ("b", 0.0), ("pitch", 1.0))]
        friction = np.array([values[f"lugre.{name}"] for name in FRICTION])
        m = values["mass.m"]
        stem = np.array([m, values["spring.K"], values["spring.F0"], p.gravity * m, *coil])
        air = np.array([
            p.stroke, p.diaphragm_area, p.dead_volume, p.gas_constant * p.gas_temperature, p.atmosphere, p.conductance,
            p.gain, p.filter_time, p.hold_steps,
        ])  # fmt: skip
        supply = np.where(u[:, 4] < p.supply_minimum, 0.0, u[:, 4])
        path, pressure, rubbing = _integrated(np.array(state.values), u[:, 0].copy(), supply, stem, friction, air)
        signals = np.zeros((len(u), len(COLUMN)))
        x = path[:, 0]
        shown: dict[str, Array | float] = {
            "CV": u[:, 0], "P1": u[:, 1], "P2": u[:, 2], "T1": u[:, 3], "X": x / p.stroke, "CVI": path[:, 6],
            "Ps": pressure, "Pz": supply, "X3": 1.0, "position": x / p.stroke, "pressure": pressure, "x": x,
            "v": path[:, 1], "friction": rubbing, "density": 1e3,
        }  # fmt: skip
        for name, values_ in shown.items():
            signals[:, COLUMN[name]] = values_
        return path[-1].copy(), signals


def compiled(function: F) -> F:
    """A function as machine code."""
    return cast(F, njit(cache=True, error_model="numpy")(function))


@compiled
def _opening(cvi: float) -> float:
    """Opening of the relay by the controller's output: a dead zone, and venting weaker than filling."""
    if cvi < -0.54:
        return max(-0.55 + (cvi + 0.94) / 0.4 * 0.53, -0.55)
    if cvi < 0.46:
        return -0.02 + (cvi + 0.54) * 0.04
    return min(0.02 + (cvi - 0.46) / 0.4 * 0.98, 1.0)


@compiled
def _pressure(x: float, mass: float, air: Array) -> float:
    """Pressure of the chamber [Pa, relative] with so much air in it [kg]."""
    return min(max(mass * air[3] / (air[2] + air[1] * x), 0.0), PRESSURE_LIMIT) - air[4]


@compiled
def _rubbing(v: float, z: float, friction: Array) -> tuple[float, float]:
    """Rate of the bristle [m/s] and friction [N], by LuGre's equations."""
    fc, fs, vs, sigma0, sigma1, sigma2 = friction
    level = fc + (fs - fc) * np.exp(-((v / vs) ** 2))
    rate = v - sigma0 * abs(v) * z / level
    return rate, sigma0 * z + sigma1 * rate + sigma2 * v


@compiled
def _rates(s: Array, demand: float, supply: float, stem: Array, friction: Array, air: Array) -> Array:
    """Rates of the states but the sampled ones."""
    m, K, F0, weight, a, b, pitch = stem
    rate, rubbing = _rubbing(s[1], s[2], friction)
    pressure, opening = _pressure(s[0], s[5], air), _opening(s[6])
    turn = 2 * np.pi * s[0] / pitch
    force = air[1] * pressure + weight - K * s[0] - F0 - rubbing - a * np.sin(turn) - b * np.cos(turn)
    drive = (supply if opening > 0 else 0.0) - pressure
    flow = air[5] * abs(opening) * np.sign(drive) * np.sqrt(abs(drive))
    limited = min(max(demand, 0.0), 1.024)
    return np.array([s[1], force / m, rate, (limited - s[3]) / air[7], (s[3] - s[4]) / air[7], flow, 0.0, 0.0])


@compiled
def _sampled(s: Array, air: Array) -> None:
    """The controller's output, when it is its turn; it counts."""
    if s[7] < 0.5:
        lever = min(max(s[0] / air[0], -0.25), 1.25)
        seen = np.arcsin(min(max(lever - 0.5, -1.0), 1.0)) / LEVER_ANGLE + 0.5
        s[6] = min(max(air[6] * (s[4] - seen), -1.0), 1.0)
    s[7] = 0.0 if s[7] + 1.5 > air[8] else s[7] + 1.0


@compiled
def _integrated(
    s: Array, demand: Array, supply: Array, stem: Array, friction: Array, air: Array
) -> tuple[Array, Array, Array]:
    """States (n, 8), pressure [Pa] and friction [N] (n,) at the beginning of every step of 2.5 ms."""
    n, h = len(demand), STEP / FINE
    path, pressure, rubbing = np.empty((n, len(s))), np.empty(n), np.empty(n)
    for k in range(n):
        path[k], pressure[k], rubbing[k] = s, _pressure(s[0], s[5], air), _rubbing(s[1], s[2], friction)[1]
        if k == n - 1:
            break
        _sampled(s, air)
        for _ in range(FINE):
            k1 = _rates(s, demand[k], supply[k], stem, friction, air)
            k2 = _rates(s + 0.5 * h * k1, demand[k], supply[k], stem, friction, air)
            k3 = _rates(s + 0.5 * h * k2, demand[k], supply[k], stem, friction, air)
            k4 = _rates(s + h * k3, demand[k], supply[k], stem, friction, air)
            s = s + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            if s[0] < 0.0 or s[0] > air[0]:
                s[0], s[1] = min(max(s[0], 0.0), air[0]), 0.0
    return path, pressure, rubbing


def main(words: Sequence[str]) -> None:
    """Serve it on loopback as `bristle serve --lock-step` would: as JSON, the options of `ActuatorOptions`, whether
    friction and effects can be changed by register, and how long [s].
    """
    about, allow_faults, longest_s = json.loads(words[0])
    options = ActuatorOptions(friction="lugre", noise=True, **about)
    plant = ActuatorPlant(replace(options.plant().setup, made_by=RungeKutta))
    address = listen_address("tcp://127.0.0.1:0")
    maps = RegisterMap.load("damadics"), WriteMap.load("damadics-write")
    served = ServerSettings([address], *maps, speed=None, harm=allow_faults)
    run({1: plant}, served, longest_s)


if __name__ == "__main__":
    main(sys.argv[1:])
