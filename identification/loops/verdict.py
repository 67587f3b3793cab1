"""One answer from all evidence: a probability of stiction, and what may be said with it."""

from __future__ import annotations

from typing import Literal

import numpy as np

from identification.loops.calibration import CAUSES_TOLD, CERTAIN, TABLES, UNLIKELY, CalibrationTable
from recordings import Array

LoopVerdict = Literal["stiction", "no_stiction", "cannot_tell"]


def table_of(integrating: bool, whole: bool) -> str:
    """The table of `TABLES` for a loop; whole : whether the data show the shape of the signals."""
    return ("integrating" if integrating else "self-regulating") if whole else "search alone"


def weighed(evidence: Array, table: str) -> dict[str, float]:
    """The probability of every cause of `CAUSES_TOLD` (they add to 1) for the evidence of a loop.

    Multinomial logistic regression on standardised evidence; what does not apply counts as average.
    """
    return dict(zip(CAUSES_TOLD, map(float, weighed_by(TABLES[table], evidence)), strict=True))


def weighed_by(table: CalibrationTable, evidence: Array) -> Array:
    """The probabilities (causes,) by a table."""
    mean, spread, weights = (np.array(part) for part in (table.mean, table.spread, table.weights))
    scaled = np.nan_to_num(np.clip((evidence - mean) / spread, -3.0, 3.0))
    scores = weights @ np.concatenate([[1.0], scaled])
    odds = np.exp(scores - scores.max())
    return np.asarray(odds / odds.sum(), float)


LIKELY = 0.5
"""Probability of backlash from which on stiction is not excluded: it may have a jump that does not show."""


def verdict(probability: float, backlash: float) -> LoopVerdict:
    """What may be said with a probability of stiction and one of backlash."""
    if probability >= CERTAIN:
        return "stiction"
    return "no_stiction" if probability <= UNLIKELY and backlash < LIKELY else "cannot_tell"
