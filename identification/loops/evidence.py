"""The evidence that the answer weighs: numbers from the methods and from the oscillation, always of one length."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.loops.methods import MethodAnswer, StictionSearch
from identification.loops.oscillation import Oscillation
from recordings import Array

NAMES = (
    "cross-correlation", "yamashita", "curve-fit", "relay-fit", "area-ratio", "parallelogram",
    "gain", "jump gain", "regularity", "gain squared", "jump gain squared",
)  # fmt: skip
"""Evidence by name; methods by their ids. The squares are there because a gain means little until it is large."""
OF_SEARCH = np.array(["gain" in name for name in NAMES])
"""What is left where the data hide the shape of the signals."""


def evidence(answers: Sequence[MethodAnswer], found: StictionSearch, oscillation: Oscillation | None) -> Array:
    """The evidence (11,), NaN where a method does not apply; each clipped to where it is known to mean something."""
    by_name = {one.method: one.value for one in answers}
    limits = {"area-ratio": (0.5, 2.0), "relay-fit": (-1.0, 1.0)}
    values = []
    for name in NAMES[:6]:
        value = by_name.get(name)
        values.append(np.nan if value is None else float(np.clip(value, *limits.get(name, (0.0, 1.0)))))
    gains = [float(np.log1p(max(one, 0.0))) for one in (found.gain, found.jump_gain)]
    regularity = float(np.log(min(oscillation.regularity, 20.0))) if oscillation else np.nan
    return np.array([*values, *gains, regularity, *(one**2 for one in gains)])


def of_search(weights: Array) -> Array:
    """The evidence without what looks at shapes."""
    return np.where(OF_SEARCH, weights, np.nan)
