"""Files and values that several tests of recordings share."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import h5py
import numpy as np

from recordings import BadInput, Event, Plant, Recording, Signal, SignalSpec

N_SAMPLES = 40
TIME = np.arange(N_SAMPLES) / 100
POSITION = 0.02 * np.sin(TIME)
FORCE = 100 * np.cos(TIME)
SPECS = [
    SignalSpec("time", "s", "time"),
    SignalSpec("position", "m", "output"),
    SignalSpec("force", "N", "input"),
]


def contract_file(path: Path) -> Path:
    """A file with every item of the format, made with h5py alone."""
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "valve-recording", "version": 1, "title": "steps", "source": "rig"})
        file.attrs.update({"created": "2026-11-21T09:30:00+01:00", "operator": "Ada", "run": 7, "ambient": 21.5})
        for name, unit, role, values in (
            ("time", "s", "time", TIME),
            ("position", "mm", "output", 1e3 * POSITION),
            ("force", "N", "input", FORCE),
            ("gland_colour", "furlong", "extra", np.full(N_SAMPLES, np.nan)),
        ):
            dataset = file.create_dataset(f"signals/{name}", data=values)
            dataset.attrs.update({"unit": unit, "role": role})
        file["signals/position"].attrs.update({"description": "stem", "resolution": 0.01, "noise_std": 0.003})
        file.create_group("plant").attrs.update(
            {"moving_mass_kg": 2.0, "stroke_m": 0.0381, "diaphragm_area_m2": 0.029, "tag": "LC74_20"}
        )
        file["plant"].attrs.update({"spring_constant_N_per_m": 60892.0, "spring_preload_N": -3.0})
        file["events/time"] = [0.1, 0.2]
        file["events/kind"] = ["note", "fault"]
        file["events/text"] = ["começo", "sticks"]
        file["truth/fc"] = 12.0
        file["drawings/plan"] = np.zeros((3, 3))
    return path


def recording() -> Recording:
    """A recording with every field set."""
    return Recording.of(
        [
            Signal("time", TIME, "s", "time"),
            Signal("position", 1e3 * POSITION, "mm", "output", "stem", 0.01, 0.003),
            Signal("force", FORCE, "N", "input"),
        ],
        plant=Plant(moving_mass_kg=2.0, stroke_m=0.0381, tag="LC74_20"),
        title="steps",
        source="rig",
        created=datetime(2026, 11, 21, 9, 30, tzinfo=UTC),
        events=(Event(0.1, "note", "começo"),),
        attributes={"operator": "Ada", "run": 7, "ambient": 21.5},
    )


def outcome(action: Callable[[], Recording]) -> Recording | BadInput:
    """What an action on bad data comes to: the only two endings that are allowed."""
    try:
        return action()
    except BadInput as error:
        return error


def assert_same(one: Recording, other: Recording) -> None:
    """Two recordings that say the same; the file does not count."""
    assert one.header == other.header
    assert one.events == other.events
    for name in one:
        np.testing.assert_array_equal(one[name].values, other[name].values)
