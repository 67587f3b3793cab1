"""One answer from all evidence: a probability of stiction, and what may be said with it."""

from __future__ import annotations

from typing import Literal

import numpy as np

from identification.loops.calibration import CAUSES_TOLD, CERTAIN, TABLES, UNLIKELY, CalibrationTable
from identification.loops.evidence import NAMES, SQUARED, in_words
from recordings import Array

LoopVerdict = Literal["stiction", "no_stiction", "cannot_tell"]


def table_of(integrating: bool, whole: bool) -> str:
    """The table of `TABLES` for a loop; whole : whether the data show the shape of the signals."""
    return ("integrating" if integrating else "self-regulating") if whole else "search alone"


MOST = 2
"""Pieces of evidence that are told of a cause."""


def weighed(evidence: Array, table: str) -> dict[str, float]:
    """The probability of every cause of `CAUSES_TOLD` (they add to 1) for the evidence of a loop.

    Multinomial logistic regression on standardised evidence; what does not apply counts as average.
    """
    return dict(zip(CAUSES_TOLD, map(float, weighed_by(TABLES[table], evidence)), strict=True))


def weighed_by(table: CalibrationTable, evidence: Array) -> Array:
    """The probabilities (causes,) by a table."""
    weights = np.array(table.weights)
    scores = weights @ np.concatenate([[1.0], _standardised(table, evidence)])
    odds = np.exp(scores - scores.max())
    return np.asarray(odds / odds.sum(), float)


def _standardised(table: CalibrationTable, evidence: Array) -> Array:
    """Evidence (k,) about its mean, in its spreads; 0 where a method does not apply."""
    mean, spread = np.array(table.mean), np.array(table.spread)
    return np.nan_to_num(np.clip((evidence - mean) / spread, -3.0, 3.0))


def speaks_for(evidence: Array, table: str) -> dict[str, tuple[str, ...]]:
    """The `MOST` pieces of evidence that most raise the odds of every cause of `CAUSES_TOLD`, in words."""
    weights = np.array(TABLES[table].weights)[:, 1:]
    parts = (weights - weights.mean(axis=0)) * _standardised(TABLES[table], evidence)
    for squared in (name for name in NAMES if name.endswith(SQUARED)):  # a square is no evidence by itself
        at, of = NAMES.index(squared), NAMES.index(squared.removesuffix(SQUARED))
        parts[:, of] += parts[:, at]
        parts[:, at] = 0.0
    told = {}
    for cause, part in zip(CAUSES_TOLD, parts, strict=True):
        best = np.argsort(-part)[:MOST]
        told[cause] = tuple(in_words(NAMES[i], float(evidence[i])) for i in best if part[i] > 0)
    return told


LIKELY = 0.5
"""Probability of backlash from which on stiction is not excluded: it may have a jump that does not show."""


def verdict(probability: float, backlash: float) -> LoopVerdict:
    """What may be said with a probability of stiction and one of backlash."""
    if probability >= CERTAIN:
        return "stiction"
    return "no_stiction" if probability <= UNLIKELY and backlash < LIKELY else "cannot_tell"
