"""One measurement, one use: what a model was fitted to, or chosen by, does not judge it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from recordings import BadInput, Recording

USES = {"fitted": None, "held out": "holdout", "reported on": "report_on"}
"""What a recording may be used for, and the parameter of a call that says so."""


def check_used_once(
    recordings: Sequence[Recording], holdout: Sequence[Recording] = (), report_on: Sequence[Recording] = ()
) -> None:
    """Raise BadInput where one measurement has two uses, or is given twice for one, by whatever name."""
    groups = tuple(zip(USES, (recordings, holdout, report_on), strict=True))
    for use, some in groups:
        for one, other in combinations(some, 2):
            if _same(one, other):
                found = f"it holds the same measurement as {one.label}, which is {use} already"
                raise BadInput(other.label, found, "it would count twice: give it once", parameter=USES[use])
    for (first, some), (second, others) in combinations(groups, 2):
        for one, other in product(some, others):
            if _same(one, other):
                remedy = f"what is {first} does not judge: give another recording"
                raise BadInput(other.label, f"it is {first} and {second}", remedy, parameter=USES[second])


def _same(one: Recording, other: Recording) -> bool:
    """Whether two recordings hold the same values at the same times, in all signals that both have."""
    shared = [name for name in one if name in other]
    return (
        len(one) == len(other) and len(shared) > 1
        and all(np.array_equal(one[name].values, other[name].values, equal_nan=True) for name in shared)
    )  # fmt: skip
