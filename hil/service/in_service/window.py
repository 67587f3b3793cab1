"""What a stretch of ordinary operation says of a valve, by the formulas of the standard tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.service.in_service.figures import SignatureCurve
from recordings import Array, BadInput, Plant, Recording, Signal

if TYPE_CHECKING:
    from identification.standard_tests import Interval, TestKind

SIGNALS = ("position", "setpoint", "drive", "pressure", "force")
"""What is kept of every sample, beside its time."""

_UNITS = {"position": "m", "setpoint": "1", "drive": "1", "pressure": "Pa", "force": "N"}

QUANTITIES = {
    "friction": "N", "spring_rate": "N/m", "dead_band": "%", "dead_time": "s", "t86": "s", "overshoot": "%",
}  # fmt: skip
"""The figures that have a history, with their units."""


@dataclass(frozen=True)
class WindowResult:
    """values : by name as in `QUANTITIES`; unit : of friction; curve : the signature; notes : what is missing, why."""

    values: Mapping[str, Interval]
    friction_unit: str
    curve: SignatureCurve | None
    steps: int
    notes: tuple[str, ...]


def looked_at(rows: Array, present: Sequence[str], plant: Plant) -> WindowResult:
    """Judge a window. rows : (n, 1 + len(SIGNALS)), time [s] first, NaN where there is none; present : signals that the
    valve has.
    """
    rows = rows[np.concatenate([[True], np.diff(rows[:, 0]) > 0.0])]
    signals = [Signal("time", rows[:, 0] - rows[0, 0], "s", "time")]
    for k, name in enumerate(SIGNALS):
        if name in present:
            signals.append(Signal(name, rows[:, 1 + k], _UNITS[name], "output" if name == "position" else "input"))
    recording = Recording.of(signals, plant=plant)
    values: dict[str, Interval] = {}
    notes: list[str] = []
    steps = _tested(recording, "step", notes)
    for name, key in (("dead_time", "Td_s"), ("t86", "T86_s"), ("overshoot", "overshoot_percent")):
        _put(values, name, steps.get(key))
    band = _tested(recording, "deadband", notes)
    if "dead_band_and_hysteresis_percent" in band:  # of a moving stem: its lag would pass for a dead band
        notes.append("dead band: the set point is never held, so that lag and dead band cannot be told apart")
    else:
        _put(values, "dead_band", band.get("dead_band_percent"))
    signature = _tested(recording, "signature", notes) if {"pressure", "force"} & set(present) else {}
    unit = "N" if "friction_N" in signature else "Pa"
    in_pascal = signature.get("friction_kPa")
    friction = signature.get("friction_N") or (in_pascal.scaled(1e3) if in_pascal else None)
    _put(values, "friction", friction)
    _put(values, "spring_rate", signature.get("spring_rate_N_per_m"))
    return WindowResult(values, unit, _curve(recording, signature, present), len(steps.get("steps", ())), tuple(notes))


def _put(values: dict[str, Interval], name: str, found: Any) -> None:
    from identification.standard_tests import Interval  # see `figures`

    if isinstance(found, Interval) and np.all(np.isfinite([found.value, found.lower, found.upper])):
        values[name] = found


def _tested(recording: Recording, kind: TestKind, notes: list[str]) -> Mapping[str, Any]:
    """The values of a test; none, with a note, where the window does not hold it."""
    from identification.standard_tests import standard_test

    try:
        return standard_test([recording], kind).values
    except BadInput as problem:
        notes.append(f"{kind}: {problem.found}")
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:  # ordinary operation holds anything
        notes.append(f"{kind}: it cannot be computed ({error})")
    return {}


def _curve(recording: Recording, signature: Mapping[str, Any], present: Sequence[str]) -> SignatureCurve | None:
    """Mean lines up and down over the positions that were passed both ways."""
    width = signature.get("width_kPa") or signature.get("width_N")
    if not width:
        return None
    place = tuple(float(x) for x, _ in width)
    half = np.array([w for _, w in width]) / 2
    bench = signature.get("bench_set_kPa")
    if "pressure" in present and bench:
        low, high = bench[0].value, bench[1].value
        mean, unit = low + (high - low) * np.array(place) / 100.0, "kPa"
    else:
        preload, slope = signature.get("preload_N"), signature.get("spring_rate_N_per_m")
        stroke = recording.plant.stroke_m
        if preload is None or slope is None or stroke is None:
            return None
        mean, unit = preload.value + slope.value * stroke * np.array(place) / 100.0, "N"
    return SignatureCurve(place, tuple((mean + half).tolist()), tuple((mean - half).tolist()), unit)
