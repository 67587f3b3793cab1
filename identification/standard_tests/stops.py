"""Where the stem meets a stop: it stays while the input goes on, by more than friction can hold it."""

from __future__ import annotations

import numpy as np

from identification.standard_tests.interval import Interval
from identification.standard_tests.run import ValveRun
from recordings import Array

HELD = 2.0
"""How far beyond the mean line the input has to go, in frictions: friction holds a stem by one or little more."""
FEWEST = 3
"""Samples that show a stop."""


def stops_of(run: ValveRun, slope: float, offset: float, friction: Array) -> dict[str, Interval]:
    """The stops [% of span] that a run shows, by name.

    slope, offset : of the mean line, input over % of span; friction (k,) : along the stroke, in the unit of the input.
    """
    assert run.driven is not None
    reach = 3 * run.noise + 1e-3 * float(np.ptp(run.position))
    excess = (run.driven - offset - slope * run.position) * np.sign(slope)
    ends = {"closed_stop_percent": -1.0, "open_stop_percent": 1.0}
    found = {}
    for name, side in ends.items():
        furthest = float(np.max(side * run.position))
        at_end = side * run.position >= furthest - 2 * reach
        pressed = at_end & (side * excess > HELD * float(np.max(friction)))
        if int(pressed.sum()) >= FEWEST:
            places = run.position[pressed]
            error = max(float(np.std(places)), run.noise) / np.sqrt(len(places))
            found[name] = Interval.about(float(np.mean(places)), error)
    return found
