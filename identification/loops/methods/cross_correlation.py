"""Cross-correlation of OP and PV: odd with stiction, even with a disturbance or tight tuning.

Horch (1999), A simple method for detection of stiction in control valves, Control Eng. Practice 7, 1221-1231. Not for
integrating processes, nor for compressible media without a second method.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.loops.methods.contract import Cycles, MethodAnswer, inapplicable, judged

NAME = "cross-correlation"


def cross_correlation(loop: Cycles) -> MethodAnswer:
    """Index: how far the correlation at lag zero is below its extreme near it, 0 (even) to 1 (odd)."""
    if loop.integrating:
        return inapplicable(NAME, "the phase of an integrating process says nothing of stiction (Horch 1999)")
    n, most = len(loop.pv), int(0.75 * loop.period)
    if n < 4 * most:
        return judged(NAME, None, 1 / 3, 2 / 3, "the phase of the cross-correlation")
    spectrum = np.fft.rfft(loop.pv, 2 * n) * np.conj(np.fft.rfft(loop.op, 2 * n))
    lagged = np.fft.irfft(spectrum)
    near = np.concatenate([lagged[-most:], lagged[: most + 1]])
    best = float(np.max(np.abs(near[most - int(loop.period / 2) : most + int(loop.period / 2) + 1])))
    zero = abs(float(lagged[0]))
    found = judged(NAME, (best - zero) / (best + zero), 1 / 3, 0.5, "1 - relative correlation at lag zero")
    return replace(found, why=f"{found.why}; no proof where the pressure is that of a gas") if loop.gas else found
