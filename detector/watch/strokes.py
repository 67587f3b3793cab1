"""How often a valve has moved to and fro: without that its usual behaviour has not been seen."""

from __future__ import annotations

import numpy as np

from recordings import Array, BadInput

LEAST_STROKES = 8
"""With fewer strokes too little of the valve's range was seen, whatever the number of samples."""

STROKE = 0.15
"""A stroke is a motion against the one before it by so much of the range."""


def strokes_of(x: Array) -> int:
    """How often a position (n_samples,) turns, motions below a share `STROKE` of its range not counted."""
    x = x[np.isfinite(x)]
    least = STROKE * float(np.quantile(x, 0.995) - np.quantile(x, 0.005)) if len(x) else 0.0
    if not least > 0:
        return 0
    turns, way, far = 0, 0, float(x[0])
    for value in x.tolist():
        if way * (value - far) >= 0 and way:
            far = value
        elif abs(value - far) >= least:
            turns, way, far = turns + (way != 0), 1 if value > far else -1, value
    return turns


def check_strokes(x: Array) -> None:
    """Raise BadInput for a position with fewer than `LEAST_STROKES`."""
    strokes = strokes_of(x)
    if strokes < LEAST_STROKES:
        found = f"the valve moved to and fro {strokes} times only"
        remedy = f"learn while it moves over its usual range and back, {LEAST_STROKES} times at least"
        raise BadInput("false-alarm rate", found, remedy)
