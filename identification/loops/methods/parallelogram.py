"""Parallelogram of OP and PV: its flat sides are the times in which the valve sticks.

Kano, Maruta, Kugemoto and Shimizu (2004), A practical method for valve stiction, IFAC DYCOPS, methods A and B. PV must
show the valve: flow loops only.
"""

from __future__ import annotations

import numpy as np

from identification.loops.methods.contract import Cycles, MethodAnswer, inapplicable, judged
from identification.loops.methods.half_cycles import smoothed

NAME = "parallelogram"


def parallelogram(loop: Cycles) -> MethodAnswer:
    """Index: share of the time in which PV stays within a band while OP goes on for long enough."""
    if not loop.flow:
        return inapplicable(NAME, "the process value does not show the valve: made for flow loops")
    pv, op = smoothed(loop.pv, 3), smoothed(loop.op, 3)
    noise = float(np.median(np.abs(np.diff(loop.pv, 2)))) / 0.6745 / np.sqrt(6)
    band = max(0.15 * float(np.std(pv)), 2 * noise)
    sticking, a = 0, 0
    while a < len(pv) - 1:
        b = a + 1
        while b < len(pv) and abs(pv[b] - pv[a]) < band:
            b += 1
        if b - a > max(3, loop.period / 10) and abs(op[b - 1] - op[a]) > 0.3 * float(np.std(op)):
            sticking += b - a
        a = b
    return judged(NAME, sticking / len(pv), 0.1, 0.25, "share of the time in which PV rests and OP moves")
