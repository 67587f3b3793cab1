"""A stiction element before a linear process: how much better than the linear process alone.

Jelali (2008) and Lee, Ren and Huang (2008); the search is that of `stiction_search`. The index is in units of
likelihood, so that it grows with the length of the data. Without stiction it stays below sixty or so: that much the
best of so many pairs gains from backlash and from disturbances.
"""

from __future__ import annotations

from identification.loops.methods.contract import MethodAnswer, judged
from identification.loops.methods.stiction_search import StictionSearch

NAME = "hammerstein"


def hammerstein_answer(found: StictionSearch) -> MethodAnswer:
    """Index: twice the log-likelihood ratio with and without the stiction element."""
    return judged(NAME, found.gain, 20.0, 60.0, "twice the log-likelihood ratio with and without stiction")
