"""A recording."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bristle.cli.output.manner import say
from recordings import Array, BadInput, RecordingFile, describe, open_recording, validate
from recordings import picture as page


def words(file: Path) -> str:
    """A recording in words; everything that is wrong with it, where it cannot be read."""
    try:
        return describe(file)
    except BadInput:
        problems = validate(file)
        if len(problems) > 1:
            say("\n  ".join([f"{len(problems)} things are wrong:", *map(str, problems)]))
        raise


def picture(file: Path) -> str:
    """Its page."""
    return page(file)


def facts(file: Path) -> Mapping[str, Any]:
    """What a recording holds, without its samples."""
    with open_recording(file) as opened:
        header, time = opened.header, opened.signal("time").values
        signals = [
            {"name": spec.name, "role": spec.role, "unit": spec.unit, **_range(_values(opened, spec.name, len(time)))}
            for spec in header.signals
        ]
        events = [{"time_s": one.time, "kind": one.kind, "text": one.text} for one in opened.events]
    created = None if header.created is None else header.created.isoformat()
    return {
        "format": "valve-recording", "version": 1, "file": file, "title": header.title, "source": header.source,
        "created": created, "samples": len(time), "seconds": time[-1] - time[0], "signals": signals,
        "plant": header.plant.known(), "events": events, "attributes": dict(header.attributes),
    }  # fmt: skip


def _values(opened: RecordingFile, name: str, samples: int) -> Array:
    """The values of a signal, all missing where it has none that is good: what a wrong map recorded is shown, too."""
    try:
        return opened.signal(name).values
    except BadInput:
        return np.full(samples, np.nan)


def _range(values: Array) -> dict[str, float | int | None]:
    there = values[np.isfinite(values)]
    low, high = (float(there.min()), float(there.max())) if len(there) else (None, None)
    return {"from": low, "to": high, "missing": int(len(values) - len(there))}
