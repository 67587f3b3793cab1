"""Area before and after the peak of half cycles of the controller error: unequal with stiction.

Singhal and Salsbury (2005), A simple method for detecting valve stiction in oscillating control loops, J. Process
Control 15, 371-382. Not for integrating processes.
"""

from __future__ import annotations

import numpy as np

from identification.loops.methods.contract import Cycles, MethodAnswer, inapplicable, judged
from identification.loops.methods.half_cycles import half_cycles, smoothed

NAME = "area-ratio"


def area_ratio(loop: Cycles) -> MethodAnswer:
    """Index: median area from the zero crossing to the peak, over that from the peak to the next zero crossing."""
    if loop.integrating:
        return inapplicable(NAME, "made for self-regulating processes")
    parts = [smoothed(part, len(part) // 5) for part in half_cycles(loop.error, loop.period)]
    ratios = []
    for part in parts:
        peak = int(np.argmax(part))
        if 0 < peak < len(part) - 1:
            half = part[peak] / 2
            ratios.append((part[:peak].sum() + half) / max(part[peak + 1 :].sum() + half, 1e-12))
    value = float(np.median(ratios)) if len(ratios) >= 6 else None
    return judged(NAME, value, 0.9, 1.15, "ratio of the areas")
