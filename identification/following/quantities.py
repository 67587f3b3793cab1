"""What one recording of natural movement says of a valve: friction, spring rate, dead band, leak."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np

from identification.comparison.signature import line, signature, travel
from identification.data.experiment import experiment
from recordings import Array, BadInput, NegativeAnswer, Recording, Signal

UNITS: Mapping[str, str] = {"fc": "N", "K": "N/m", "dead_band": "%", "leak": "% of the largest flow"}
"""Quantities that are followed, and their units."""
CLOSED = 0.01
"""A valve is closed within this share of the travel from its lowest place."""
FEWEST = 20
"""Samples of a closed valve that a leak needs."""
BLOCKS = 10
"""Parts of the closed time whose means give the standard deviation of a leak."""
INPUTS = ("setpoint", "drive")


@dataclass(frozen=True)
class SeenValue:
    """A quantity as one recording shows it. value, std : in the unit of `UNITS`; strokes or samples it rests on."""

    name: str
    value: float
    std: float


@dataclass(frozen=True)
class SeenRecording:
    """What a recording says: values by name; missing : why others are not told, in a sentence each."""

    label: str
    date: datetime
    values: Mapping[str, SeenValue]
    missing: Mapping[str, str]


def seen_in(recording: Recording) -> SeenRecording:
    """What a recording says. Raises BadInput for one without a date."""
    if recording.created is None:
        remedy = "import it with its date, or give files whose names begin with it: 2026-11-21_valve.h5"
        raise BadInput(f"{recording.label}: /created", "there is no date", remedy)
    values: dict[str, SeenValue] = {}
    missing: dict[str, str] = {}
    for names, found in ((("fc", "K"), _friction_and_rate), (("dead_band",), _dead_band), (("leak",), _leak)):
        try:
            values |= {one.name: one for one in found(recording)}
        except (BadInput, NegativeAnswer) as why:
            missing |= dict.fromkeys(names, str(why))
    return SeenRecording(recording.label, recording.created, values, missing)


def _friction_and_rate(recording: Recording) -> tuple[SeenValue, ...]:
    """Friction level [N] and spring rate [N/m] from the two lines of the strokes."""
    found, spread = _lines(recording)
    return SeenValue("fc", found[2], spread[2]), SeenValue("K", found[1], spread[1])


def _dead_band(recording: Recording) -> tuple[SeenValue, ...]:
    """Distance of the lines of both directions in the input [% of its span]."""
    name = next((one for one in INPUTS if one in recording), None)
    if name is None:
        raise BadInput(recording.label, "there is neither a set point nor a drive signal", "record what was asked")
    signal = recording[name]
    if signal.unit in ("%", "1"):
        percent = signal.values * (100.0 if signal.unit == "1" else 1.0)
    elif recording.plant.stroke_m:
        percent = 100 * recording.si(name).values / recording.plant.stroke_m
    else:
        raise BadInput(recording.label, f"{name} is in {signal.unit} and the stroke is not known", "say it on import")
    signals = {one: recording[one] for one in ("time", "position")}
    signals["force"] = Signal("force", percent, "N", "input", "the input, in the place of a force")
    found, spread = _lines(replace(recording, signals=signals))
    return (SeenValue("dead_band", 2 * abs(found[2]), 2 * spread[2]),)


def _lines(recording: Recording) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Height, slope and half distance of the lines of strokes, and their standard deviations."""
    e = experiment(recording, "force")
    found, covariance, _ = line(signature(e, *travel(e)))
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return tuple(map(float, found)), tuple(float(max(s, 1e-6 * abs(v))) for s, v in zip(spread, found, strict=True))


def _leak(recording: Recording) -> tuple[SeenValue, ...]:
    """Flow through the closed valve, % of the largest flow of the recording."""
    if "flow" not in recording or "position" not in recording:
        raise BadInput(recording.label, "there is no flow", "record the flow beside the position")
    flow, x = recording["flow"].values, recording["position"].values
    good = np.isfinite(flow) & np.isfinite(x)
    flow, x = flow[good], x[good]
    stroke = recording.si("position").values[good]
    span = recording.plant.stroke_m or float(np.ptp(stroke))
    closed = stroke <= CLOSED * span
    if int(closed.sum()) < FEWEST:
        raise BadInput(recording.label, "the valve is hardly ever closed", "a leak shows while it is")
    most = float(np.quantile(flow, 0.99))
    if not most > 0:
        raise BadInput(recording.label, "nothing flows", "a leak is a share of the largest flow")
    means = _means(100 * flow[closed] / most)
    return (SeenValue("leak", float(np.mean(means)), float(np.std(means, ddof=1) / np.sqrt(len(means)) + 1e-6)),)


def _means(values: Array) -> Array:
    """Means of equal parts: what they differ by is noise that may be correlated."""
    return np.array([part.mean() for part in np.array_split(values, BLOCKS)])
