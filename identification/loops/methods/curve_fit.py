"""Curve fit of half cycles: triangle with stiction, sine without.

He, Wang, Pottmann and Qin (2007), Ind. Eng. Chem. Res. 46, 4549-4560: OP of self-regulating processes, PV of
integrating ones. Asymmetric friction blurs it.
"""

from __future__ import annotations

import numpy as np

from identification.loops.methods.contract import Cycles, MethodAnswer, judged
from identification.loops.methods.half_cycles import half_cycles, misfit, sine, triangles

NAME = "curve-fit"


def curve_fit(loop: Cycles) -> MethodAnswer:
    """Index: error of the sine over the sum of the errors of sine and triangle."""
    parts = half_cycles(loop.pv if loop.integrating else loop.op, loop.period)
    if len(parts) < 6:
        return judged(NAME, None, 0.4, 0.6, "stiction index")
    sines = float(np.mean([misfit(part, sine(len(part))) for part in parts]))
    corners = float(np.mean([min(misfit(part, one) for one in triangles(len(part))) for part in parts]))
    return judged(NAME, sines / max(sines + corners, 1e-12), 0.4, 0.6, "stiction index")
