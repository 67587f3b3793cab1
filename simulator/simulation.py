"""Simulated recordings: a valve moved by an excitation, as sensors and sampling show it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from recordings import Array, BadInput, Plant, Recording, Signal
from simulator.compile.kernel import Kernel, kernel
from simulator.effect import Catalogue
from simulator.effects import BASE, CATALOGUE
from simulator.excitation import LOW, Excitation, force_demand, staircase
from simulator.positioner import positioned

FINE_STEP = 5e-5
"""Sub-step of simulated recordings [s]: its error is far below any sensor noise."""
MOST_SAMPLES = 20_000_000
"""Longest recording that is simulated: about ten times the memory of its signals is needed on the way."""


@dataclass(frozen=True)
class Sensors:
    """What sampling and sensors do: sampling rate [Hz], noise standard deviations and quantisation steps (0: none).

    Raises BadInput for a rate that is not positive, and for noise or a step that is negative or not finite.
    """

    rate: float = 500.0
    position_noise: float = 0.0
    force_noise: float = 0.0
    position_step: float = 0.0
    force_step: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.rate < np.inf:
            raise BadInput(f"sampling rate {self.rate:g}", "it is not a positive number", "give it in Hz, as in 500")
        for name in ("position_noise", "force_noise", "position_step", "force_step"):
            value = getattr(self, name)
            if not 0 <= value < np.inf:
                raise BadInput(f"{name.replace('_', ' ')} {value:g}", "it is negative or not finite", "give 0 or more")


def random_valve(seed: int) -> tuple[dict[str, float], float]:
    """A plausible LuGre valve and its stroke [m].

    m 2-5 kg, K 1e4-1e5 N/m, stroke 20-40 mm, fc 50-300 N, sigma0 1e5-1e7 N/m.
    """
    rng = np.random.default_rng(seed)
    m, K, stroke = rng.uniform(2, 5), 10 ** rng.uniform(4, 5), rng.uniform(0.02, 0.04)
    fc, sigma0 = rng.uniform(50, 300), 10 ** rng.uniform(5, 7)
    values = {
        "mass.m": m, "spring.K": K, "spring.F0": rng.uniform(0.1, 0.5) * K * stroke,
        "lugre.fc": fc, "lugre.fs": fc * rng.uniform(1.1, 1.6), "lugre.vs": 10 ** rng.uniform(-3, -2),
        "lugre.sigma0": sigma0, "lugre.sigma1": rng.uniform(0.2, 1) * np.sqrt(sigma0 * m),
        "lugre.sigma2": rng.uniform(100, 1000),
    }  # fmt: skip
    return {name: float(value) for name, value in values.items()}, float(stroke)


def simulate(
    values: Mapping[str, float],
    excitation: Excitation,
    sensors: Sensors,
    *,
    stroke: float,
    effects: tuple[str, ...] = BASE,
    seed: int = 0,
    catalogue: Catalogue = CATALOGUE,
) -> tuple[Recording, dict[str, float | Array | str]]:
    """Simulate a recording. Returns it and the truth (parameters, effects, hidden position, velocity and force).

    values : parameters by full name, SI units; stroke [m]; effects : ids, looked up in the `catalogue`. The same seed
    gives the same recording.
    Raises BadInput for a parameter outside its bounds, for more than `MOST_SAMPLES` samples and for a valve whose
    trajectory does not stay finite, KeyError for a missing parameter and an unknown effect.
    """
    valve = kernel(effects, catalogue=catalogue)
    p = _checked(valve, values)
    t = _clock(excitation.duration, sensors.rate)
    run = _closed_loop if excitation.closed_loop else _open_loop
    force, position = run(valve, p, dict(values), excitation, t, stroke, seed)
    if not np.isfinite(position).all():
        raise BadInput("simulation", "the trajectory does not stay finite", "check the parameters of the valve")
    rng = np.random.default_rng([seed, 1])
    measured = _sensed(position, sensors.position_noise, sensors.position_step, rng)
    sensed_force = _sensed(force, sensors.force_noise, sensors.force_step, rng)
    signals = [
        Signal("time", t, "s", "time"),
        Signal("force", sensed_force, "N", "input", "net force of the actuator on the stem",
               sensors.force_step or None, sensors.force_noise or None),
        Signal("position", measured, "m", "output", "stem position",
               sensors.position_step or None, sensors.position_noise or None),
    ]  # fmt: skip
    recording = Recording.of(signals, plant=Plant(stroke_m=stroke), source="simulated")
    truth: dict[str, float | Array | str] = {
        **values,
        "effects": " ".join(effects),
        "position": position,
        "force": force,
    }
    return recording, truth


def _checked(valve: Kernel, values: Mapping[str, float]) -> Array:
    """The parameter vector of values that the physics allows."""
    for name, parameter in valve.catalogue.parameters(valve.effects).items():
        if name in values and not parameter.allows(values[name]):
            raise BadInput(f"{name} = {values[name]:g}", "no such valve can be", f"it is {parameter.bounds}")
    return valve.vector(values)


def _clock(duration: float, rate: float) -> Array:
    if duration * rate > MOST_SAMPLES:
        found = f"that is {duration * rate:.3g} samples"
        raise BadInput(f"{duration:g} s at {rate:g} Hz", found, f"at most {MOST_SAMPLES} are simulated at once")
    return np.arange(round(duration * rate) + 1) / rate


def _sensed(signal: Array, noise: float, quantum: float, rng: np.random.Generator) -> Array:
    noisy = signal + rng.normal(0.0, noise, len(signal)) if noise else signal.copy()
    return np.round(noisy / quantum) * quantum if quantum else noisy


def _open_loop(
    valve: Kernel, p: Array, values: dict[str, float], excitation: Excitation, t: Array, stroke: float, seed: int
) -> tuple[Array, Array]:
    """The force is given: one run of the kernel."""
    spring, preload = values.get("spring.K", 0.0), values.get("spring.F0", 0.0)
    friction = max(values.get("lugre.fs", 0.0), values.get("lugre.fc", 0.0))
    force = force_demand(excitation, t, spring=spring, preload=preload, stroke=stroke, friction=friction, seed=seed)
    rest = (force[0] - preload) / spring if spring else 0.0
    return force, valve.run(t, force, p, valve.start(rest, force=force[0]), h_max=FINE_STEP).outputs[:, 0]


def _closed_loop(
    valve: Kernel, p: Array, values: dict[str, float], excitation: Excitation, t: Array, stroke: float, seed: int
) -> tuple[Array, Array]:
    """A positioner moves the valve through a staircase."""
    demand = staircase(t, excitation.duration, np.random.default_rng(seed)) * stroke
    return positioned(valve, p, values, t, demand, stroke=stroke, start=LOW * stroke, h_max=FINE_STEP)
