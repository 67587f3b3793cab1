"""Where measured data lie that do not come with the package: in the folder BRISTLE_DATA, or beside the repository."""

from __future__ import annotations

import os
from pathlib import Path

DATA = Path(os.environ.get("BRISTLE_DATA") or Path(__file__).parents[1] / "../shared/data").resolve()

DAMADICS = DATA / "damadics"
"""Measurements and simulations of the benchmark actuator."""

PLANT_HOUR = DAMADICS / "OneHourTestData_ExampleII.mat"
"""An hour of a real valve, one sample a second."""
