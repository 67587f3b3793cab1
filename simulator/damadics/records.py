"""The samples of a run as a recording in SI units, and the truth behind it."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from recordings import Array, Event, Integers, Plant, Recording, Role, Signal, Truth
from simulator.damadics.actuator.actuator import COLUMN, Actuator
from simulator.damadics.actuator.parameters import Parameters
from simulator.damadics.faults import STEPS_PER_SECOND, Fault, strengths
from simulator.damadics.noise import CHANNELS, Noise
from simulator.damadics.scenarios import Scenario
from simulator.damadics.transmitters import SPANS

HIDDEN = ("Fv", "Fv3", "Fvc", "X3", "position", "pressure", "x", "v", "friction", "density")
"""Signals that are never measured; in the truth, with the signed strength of every fault as ``f4``."""

_TAG = "DAMADICS-3"


@dataclass(frozen=True)
class Samples:
    """Samples of a run: step numbers (n,), noise-free set point (n,), signals (n, n_signals), transmitters (n, 9)."""

    steps: Integers
    setpoint: Array
    signals: Array
    shares: Array

    @classmethod
    def joined(cls, blocks: list[Samples]) -> Samples:
        """Blocks one after the other."""
        columns = zip(*((b.steps, b.setpoint, b.signals, b.shares) for b in blocks), strict=True)
        return cls(*(np.concatenate(column) for column in columns))

    @property
    def time(self) -> Array:
        """Time of each sample [s]."""
        return self.steps / STEPS_PER_SECOND


@dataclass(frozen=True)
class _Channel:
    """How a transmitter appears in a recording: signal name, unit, role and description."""

    name: str
    unit: str
    role: Role
    text: str


_CHANNELS = {
    "X": _Channel("position", "m", "output", "rod displacement from open to closed"),
    "CVI": _Channel("drive", "1", "extra", "output of the positioner's controller: 0 vents, 1 fills"),
    "Ps": _Channel("pressure", "Pa", "input", "chamber pressure, relative"),
    "Pz": _Channel("supply_pressure", "Pa", "input", "supply pressure, relative"),
    "P1": _Channel("upstream_pressure", "Pa", "input", "inlet pressure"),
    "P2": _Channel("downstream_pressure", "Pa", "input", "outlet pressure"),
    "T1": _Channel("temperature", "degC", "input", "temperature of the medium"),
    "F": _Channel("mass_flow", "t/h", "output", "mass flow of valve and bypass, the benchmark's F'"),
}


def recording(what: Scenario, actuator: Actuator, noise: Noise | None, samples: Samples) -> Recording:
    """The recording of a run. Its `flow` is the volume flow at inlet conditions, `mass_flow` over the true density."""
    stride = int(samples.steps[1] - samples.steps[0])
    deviation = noise.deviation(stride) if noise else 0.0
    scales = dict(SPANS) | {"X": actuator.parameters.stroke}
    signals = [
        Signal("time", samples.time, "s", "time"),
        Signal("setpoint", 100 * samples.setpoint, "%", "input", "set point of the closing, without noise"),
    ]
    for channel, about in _CHANNELS.items():
        values = samples.shares[:, CHANNELS.index(channel)] * scales[channel]
        noise_std = deviation * scales[channel] or None
        signals.append(Signal(about.name, values, about.unit, about.role, about.text, None, noise_std))
    signals.append(_volume_flow(samples, deviation))
    return Recording.of(
        signals, plant=_plant(actuator.parameters), title=f"DAMADICS actuator: {what.text}", source="simulated",
        events=_events(what.faults, float(samples.time[-1])), attributes={"scenario": what.name},
    )  # fmt: skip


def truth(what: Scenario, actuator: Actuator, noise: Noise | None, samples: Samples) -> Truth:
    """What only the simulator knows: hidden signals and fault strengths over time, and every constant."""
    values: dict[str, float | str | Array] = {name: samples.signals[:, COLUMN[name]] for name in HIDDEN}
    every = strengths(what.faults, samples.time)
    values |= {f"f{fault.number}": every[:, fault.number - 1] for fault in what.faults}
    values |= {
        "scenario": what.name,
        "form": actuator.form,
        "effects": " ".join(effect.id for effect in actuator.chosen),
    }
    values |= {f"actuator.{name}": value for name, value in asdict(actuator.parameters).items()}
    values |= {"doc_sign": float(actuator.doc_sign), "noise.seed": -1.0, "noise.white": 0.0, "noise.hum": 0.0}
    if noise:
        values |= {"noise.seed": float(noise.seed), "noise.white": noise.white, "noise.hum": noise.hum}
    return values | actuator.values


def _volume_flow(samples: Samples, deviation: float) -> Signal:
    density = samples.signals[:, COLUMN["density"]]
    volume = 1000 * SPANS["F"] * samples.shares[:, CHANNELS.index("F")] / density
    noise_std = 1000 * SPANS["F"] * deviation / float(np.mean(density)) or None
    return Signal("flow", volume, "m3/h", "output", "volume flow at inlet conditions", None, noise_std)


def _plant(p: Parameters) -> Plant:
    return Plant(p.mass, p.stroke, p.diaphragm_area, p.spring_rate, p.preload, _TAG)


def _events(faults: tuple[Fault, ...], end: float) -> tuple[Event, ...]:
    found = []
    for fault in faults:
        name = f"f{fault.number} {fault.kind.name}"
        manner = f"over {fault.development_s:g} s" if fault.development_s else "at once"
        found.append((fault.start_s, "fault", f"{name}: {fault.sign * fault.strength:+g}, {manner}"))
        found.append((fault.stop_s, "fault_end", f"{name}: gone"))
    return tuple(Event(*event) for event in found if event[0] <= end)
