"""Relay fit of half cycles of PV: relay or triangle with stiction, sine without.

Rossi and Scali (2005), A comparison of techniques for automatic detection of stiction, J. Process Control 15, 505-514.
Not for integrating processes, whose PV is a sine or a parabola either way.
"""

from __future__ import annotations

import numpy as np

from identification.loops.methods.contract import Cycles, MethodAnswer, inapplicable, judged
from identification.loops.methods.half_cycles import half_cycles, misfit, relays, sine, triangles

NAME = "relay-fit"


def relay_fit(loop: Cycles) -> MethodAnswer:
    """Index: (error of the sine - that of the better stiction shape) over their sum."""
    if loop.integrating:
        return inapplicable(NAME, "the process integrates what the relay would show")
    parts = half_cycles(loop.pv, loop.period)
    if len(parts) < 6:
        return judged(NAME, None, 0.0, 0.21, "stiction index")
    sines = float(np.mean([misfit(part, sine(len(part))) for part in parts]))
    square = float(np.mean([min(misfit(part, one) for one in relays(len(part))) for part in parts]))
    corner = float(np.mean([min(misfit(part, one) for one in triangles(len(part))) for part in parts]))
    best = min(square, corner)
    return judged(NAME, (sines - best) / max(sines + best, 1e-12), 0.0, 0.21, "stiction index")
