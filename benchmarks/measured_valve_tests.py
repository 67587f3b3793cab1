"""What `bristle test` says of the measured curves of the benchmark actuator's servomotor: signature, steps, positioner.

    python -m benchmarks.measured_valve_tests

The curves are read out of drawings, so they are polygons: they are sampled evenly along their edges.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import bristle as br
from benchmarks.measured_data import DAMADICS
from identification.standard_tests import Interval
from recordings import Array, Plant, Recording

STROKE = Plant(stroke_m=0.0381)
STEP_S = 0.02
PER_EDGE = 10
"""Samples along an edge of a curve that has no time."""


def columns(file: Path) -> Array:
    """The two columns of numbers of a curve, (n, 2)."""
    return np.genfromtxt(file, delimiter=",", skip_header=1, usecols=(0, 1))


def without_time(file: Path, driver: str) -> Recording:
    """A curve of stem over input, walked along evenly."""
    corners = columns(file)
    n = len(corners)
    at = np.arange((n - 1) * PER_EDGE + 1) / PER_EDGE
    given, stem = (np.interp(at, np.arange(n), one) for one in corners.T)
    units = {"position": "%", driver: "kPa" if driver == "pressure" else "%"}
    return Recording.from_arrays(time=at, position=stem, units=units, plant=STROKE, **{driver: given})


def of_step(file: Path) -> Recording:
    """A step response, whose vertical unit is not stated: its own range is taken for a hundred per cent."""
    t, stem = columns(file).T
    even = np.arange(t[0], t[-1], 1e3 * STEP_S)
    share = 100 * (np.interp(even, t, stem) - stem.min()) / np.ptp(stem)
    return Recording.from_arrays(time=even / 1e3, position=share, units={"position": "%"}, plant=STROKE)


def lines(values: Mapping[str, object], indent: str = "  ") -> list[str]:
    """Values in lines; the pairs of a width along the stroke are left out."""
    found = []
    for name, value in values.items():
        if isinstance(value, Interval):
            found.append(f"{indent}{name} {value.value:.4g} ({value.lower:.4g} to {value.upper:.4g})")
        elif isinstance(value, float):
            found.append(f"{indent}{name} {value:.4g}")
    return found


def main() -> None:
    """The command line."""
    made = [
        ("signature", "figure 5", without_time(DAMADICS / "fig5_valve_signature.csv", "pressure")),
        ("step", "figure 6, up", of_step(DAMADICS / "fig6_step_up.csv")),
        ("step", "figure 7, down", of_step(DAMADICS / "fig7_step_down.csv")),
        ("error-band", "figure 8, with positioner", without_time(DAMADICS / "fig8_with_positioner.csv", "setpoint")),
    ]
    for kind, name, recording in made:
        found = br.test(recording, kind)
        print(f"{name}: bristle test --kind {kind}")
        print("\n".join(lines(found.values)))
        for step in found.values.get("steps", ()):
            print("\n".join(lines(step, "    ")))
        for problem in found.problems:
            print(f"  {problem}")


if __name__ == "__main__":
    main()
