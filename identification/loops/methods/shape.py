"""Shape of the path of OP and PV: how often the valve stands while the controller moves.

Yamashita (2006), An automatic method for detection of valve stiction in process control loops, Control Eng. Practice
14, 503-510, index rho 1. Made for flow, where PV follows the valve at once; not for other loops.
"""

from __future__ import annotations

import numpy as np

from identification.loops.methods.contract import Cycles, MethodAnswer, inapplicable, judged
from identification.loops.methods.half_cycles import smoothed
from recordings import Array

NAME = "yamashita"


def shape(loop: Cycles) -> MethodAnswer:
    """Index: share of samples with OP moving and PV at rest, of all in which anything moves; chance gives 0.25."""
    if not loop.flow:
        return inapplicable(NAME, "the process value does not show the valve: made for flow loops")
    op, pv = _symbols(loop.op), _symbols(loop.pv)
    moves = (op != 0) | (pv != 0)
    if not moves.any():
        return judged(NAME, None, 0.2, 0.25, "rho 1")
    return judged(NAME, float(np.mean((op != 0)[moves] & (pv == 0)[moves])), 0.2, 0.25, "rho 1")


def _symbols(values: Array) -> Array:
    """-1, 0 or 1 for falling, resting, rising: normalised differences of the smoothed signal against one deviation."""
    change = np.diff(smoothed(values, 3))
    scaled = change / max(float(np.std(change)), 1e-12)
    return np.where(np.abs(scaled) < 1.0, 0, np.sign(scaled))
