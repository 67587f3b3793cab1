"""The evidence that the answer weighs: numbers from the methods and from the oscillation, always of one length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identification.loops.methods import MethodAnswer, StictionSearch
from identification.loops.oscillation import Oscillation
from recordings import Array

SHAPES = ("cross-correlation", "yamashita", "curve-fit", "relay-fit", "area-ratio", "parallelogram")
GAINS = ("gain", "jump gain", "beyond")
SQUARED = " squared"
SEARCHED = (*GAINS, "weakest", "width", f"weakest{SQUARED}", f"width{SQUARED}", "S")
NAMES = (*SHAPES, "regularity", *SEARCHED)
"""Evidence by name; methods by their ids, the others as of `StictionSearch`, and the weakest of its gains, as each of
them speaks against another rival. The squares are there because a gain means little until it is large, and because the
valve that makes a loop swing is neither narrow nor wide. Good valves have an S, too: a small one."""
WORDS: Mapping[str, str] = {
    "regularity": "regularity of the oscillation", "gain": "gain of S and J over a linear process",
    "jump gain": "gain of a jump over backlash", "beyond": "gain over a linear process of high order",
    "weakest": "least of the gains", "width": "S over half the range of OP", "S": "S in % of OP",
}  # fmt: skip
"""What evidence is called that is no method's index."""
SLIGHT = (0.05, 0.4)
"""S [% of OP] that good valves have, too: from the upper end on it is no evidence any more."""
OF_SEARCH = np.array([name in SEARCHED for name in NAMES])
"""What is left where the data hide the shape of the signals."""


def evidence(
    answers: Sequence[MethodAnswer], found: StictionSearch, oscillation: Oscillation | None, op_percent: bool
) -> Array:
    """The evidence (k,), NaN where a method does not apply; each clipped to where it is known to mean something.

    op_percent : whether OP, and so S, is in % of its range.
    """
    by_name = {one.method: one.value for one in answers}
    limits = {"area-ratio": (0.5, 2.0), "relay-fit": (-1.0, 1.0)}
    values = []
    for name in SHAPES:
        value = by_name.get(name)
        values.append(np.nan if value is None else float(np.clip(value, *limits.get(name, (0.0, 1.0)))))
    regularity = float(np.log(min(oscillation.regularity, 20.0))) if oscillation else np.nan
    gains = [float(np.log1p(max(one, 0.0))) for one in (found.gain, found.jump_gain, found.beyond)]
    squared = np.array([min(gains), np.log(max(found.width, 0.1))])
    size = float(np.log(np.clip(found.best[0], *SLIGHT))) if op_percent else np.nan
    return np.array([*values, regularity, *gains, *squared, *squared**2, size])


def in_words(name: str, value: float) -> str:
    """A piece of evidence as it is told: gains and sizes are weighed by their logarithms."""
    if name not in WORDS:
        return f"{name} {value:.3g}"
    plain = np.expm1(value) if name in GAINS or name == "weakest" else np.exp(value)
    return f"{WORDS[name]} {plain:.3g}"


def of_search(weights: Array) -> Array:
    """The evidence without what looks at shapes."""
    return np.where(OF_SEARCH, weights, np.nan)
