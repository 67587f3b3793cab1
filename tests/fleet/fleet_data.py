"""Recordings of a small plant, in a folder, for the tests of fleets."""

from __future__ import annotations

from pathlib import Path

from bristle.fleet.work import Row
from recordings import Recording, bundled, write

OWN = ("seconds", "worker", "worker_memory_MB")
"""What a result says of its worker and not of its valve."""


def plant(folder: Path, n_valves: int = 6) -> Path:
    """A folder with a step test of each of some valves, no two alike, and one file that is no recording."""
    folder.mkdir()
    step = bundled("step")
    for k in range(n_valves):
        position = step["position"].values * (1.0 - 0.01 * k)
        made = Recording.from_arrays(
            time=step.time, position=position, force=step["force"].values, plant=step.plant, source="rig"
        )
        write(folder / f"FV-{101 + k}.h5", made)
    (folder / "FV-999.h5").write_bytes(b"not a recording")
    return folder


def told(rows: list[Row]) -> dict[str, Row]:
    """What rows say of their valves, by key."""
    return {row["key"]: {name: value for name, value in row.items() if name not in OWN} for row in rows}
