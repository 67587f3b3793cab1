"""What a valve test takes out of a recording: clock, what drove the valve, and the stem position in % of the span."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.data.noise import noise_std
from recordings import Array, BadInput, Recording

INPUTS = ("setpoint", "drive", "pressure", "force")
"""Signals that may drive a test, the best first."""

FEWEST = 20
"""Samples below which nothing is judged."""


@dataclass(frozen=True)
class ValveRun:
    """One recording of a test, arrays (n,) without missing samples.

    name : of the recording; t : s; position : % of span; noise : standard deviation of its noise [%]; driven : what
    drove the valve, in `unit`, None where no such signal was recorded; driver : its name; stroke_m : stroke [m] where
    it is known.
    """

    name: str
    t: Array
    position: Array
    noise: float
    driven: Array | None
    driver: str | None
    unit: str
    stroke_m: float | None

    @property
    def dt(self) -> float:
        """Usual distance of samples [s]."""
        return float(np.median(np.diff(self.t)))


def run_of(recording: Recording, drivers: tuple[str, ...] = INPUTS) -> ValveRun:
    """The run of a recording. Raises BadInput where there is no position, no span, or too little to judge."""
    position = in_percent(recording, "position")
    driver = next((name for name in drivers if name in recording), None)
    driven, unit = driving(recording, driver) if driver else (None, "")
    good = np.isfinite(position) & (np.isfinite(driven) if driven is not None else True)
    if int(good.sum()) < FEWEST:
        found = f"{int(good.sum())} samples have a position and what drove it"
        raise BadInput(recording.label, found, f"a test needs at least {FEWEST}")
    kept = position[good]
    if np.ptp(kept) == 0.0:
        raise BadInput(f"{recording.label}: /signals/position", "it never changes", "record a test that moves the stem")
    driven = None if driven is None else driven[good]
    return ValveRun(
        recording.label, recording.time[good], kept, noise_std(kept), driven, driver, unit, recording.plant.stroke_m
    )


def driving(recording: Recording, driver: str) -> tuple[Array, str]:
    """The signal that drove the valve, and its unit: % for a set point or a drive signal, else SI."""
    if driver in ("setpoint", "drive"):
        return in_percent(recording, driver), "%"
    signal = recording.si(driver)
    return signal.values, signal.unit


def in_percent(recording: Recording, name: str) -> Array:
    """A position or a set point in % of span, shape (n,). Raises BadInput where the span is not known."""
    signal = recording[name]
    if signal.unit in ("1", "%"):
        return signal.values * (100.0 if signal.unit == "1" else 1.0)
    stroke = recording.plant.stroke_m
    if stroke is None:
        remedy = "say stroke_m of the plant on import, or store the signal in %"
        raise BadInput(
            f"{recording.label}: /signals/{name}", f"it is in {signal.unit} and the stroke is not known", remedy
        )
    meant = recording.si(name)
    if meant.unit != "m":
        found = f"its unit '{signal.unit}' is neither a length nor a share of the span"
        raise BadInput(f"{recording.label}: /signals/{name}", found, "store it in %, 1 or a length")
    return meant.values / stroke * 100.0
