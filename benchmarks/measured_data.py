"""Where measured data lie that do not come with the package: in the folder BRISTLE_DATA, or beside the repository."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from recordings import Recording, read
from recordings.importers import import_to

DATA = Path(os.environ.get("BRISTLE_DATA") or Path(__file__).parents[1] / "../shared/data").resolve()

DAMADICS = DATA / "damadics"
"""Measurements and simulations of the benchmark actuator."""

PLANT_HOUR = DAMADICS / "OneHourTestData_ExampleII.mat"
"""An hour of a real valve, one sample a second."""


def imported(file: Path, mapping: str) -> Recording:
    """A measured file as a recording. Raises BadInput when it is not there."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "measured.h5"
        import_to(file, target, mapping, {})
        return read(target)
