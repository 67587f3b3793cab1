"""Bicoherence of the controller error, whose phases belong together in a nonlinear loop; then an ellipse.

Choudhury, Shah and Thornhill (2004), Diagnosis of poor control-loop performance using higher-order statistics,
Automatica 40, 1719-1728. It needs long data, and sees nonlinearity that is not symmetric.
"""

from __future__ import annotations

import numpy as np

from identification.loops.methods.contract import Cycles, MethodAnswer, Says
from identification.loops.methods.half_cycles import smoothed

NAME = "bicoherence"
SEGMENT = 64
FEWEST = 16


def bicoherence(loop: Cycles) -> MethodAnswer:
    """Index: largest less mean squared bicoherence; then the width of the ellipse of OP and PV."""
    error, step = loop.error, SEGMENT // 2
    starts = range(0, len(error) - SEGMENT + 1, step)
    if len(starts) < FEWEST:
        return MethodAnswer(NAME, None, "undecided", f"{len(starts)} segments are fewer than {FEWEST}: longer data")
    window = np.hanning(SEGMENT)
    lines = np.array([np.fft.rfft((error[a : a + SEGMENT] - error[a : a + SEGMENT].mean()) * window) for a in starts])
    most = SEGMENT // 4
    i, k = (index.ravel() for index in np.meshgrid(np.arange(1, most), np.arange(1, most)))
    i, k = i[i >= k], k[i >= k]
    triple = lines[:, i] * lines[:, k] * np.conj(lines[:, i + k])
    power = np.mean(np.abs(lines[:, i] * lines[:, k]) ** 2, 0) * np.mean(np.abs(lines[:, i + k]) ** 2, 0)
    strong = power > 1e-4 * power.max()
    squared = np.abs(triple.mean(0))[strong] ** 2 / power[strong]
    chance = 3.0 / len(starts) * 2  # 95 % of squared bicoherence of linear data, overlapping segments
    value = float(squared.max() - squared.mean() - 2 * squared.std() - chance)
    if value <= 0:
        return MethodAnswer(
            NAME, value, "undecided", f"nonlinearity index {value:.3g}: no asymmetric nonlinearity seen"
        )
    width = _ellipse(loop)
    says: Says = "stiction" if width > 0.25 else "undecided"
    return MethodAnswer(NAME, value, says, f"nonlinearity index {value:.3g}, ellipse of OP and PV {width:.2g} wide")


def _ellipse(loop: Cycles) -> float:
    """Smaller over larger axis of the cloud of OP and PV, both scaled, smoothed."""
    values = np.linalg.eigvalsh(np.cov(smoothed(loop.op, 3), smoothed(loop.pv, 3)))
    return float(np.sqrt(max(values[0], 0.0) / values[1]))
