"""What a historian keeps of a loop: whole, rounded, with a dead band, or interpolated between what it kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.loops.loop import ControlLoop
from recordings import Array

HOW = ("whole", "rounded", "dead band", "interpolated")
SHARES = (0.55, 0.15, 0.15, 0.15)
"""How often a simulated historian keeps a loop so."""


def as_kept(loop: ControlLoop, seed: int, how: str | None = None) -> tuple[ControlLoop, str]:
    """The loop as the historian of a seed keeps it, and which of `HOW` that is. The step or the dead band is drawn from
    a hundredth of PV's standard deviation to all of it."""
    rng = np.random.default_rng([seed, 28])
    drawn, size = HOW[int(rng.choice(len(HOW), p=SHARES))], 10 ** rng.uniform(-2.0, 0.0) * float(np.std(loop.pv))
    how = drawn if how is None else how
    if how == "rounded":
        return quantised(loop, size), how
    if how == "dead band":
        return compressed(loop, size), how
    return (interpolated(loop, size), how) if how == "interpolated" else (loop, how)


def quantised(loop: ControlLoop, step: float) -> ControlLoop:
    """The loop as a transmitter or a historian keeps it that rounds PV to whole steps, in the unit of PV."""
    return replace(loop, pv=np.round(loop.pv / step) * step)


def compressed(loop: ControlLoop, band: float) -> ControlLoop:
    """The loop as a historian keeps it that drops PV samples within a dead band, in the unit of PV, and repeats."""
    kept = loop.pv.copy()
    for k in range(1, len(kept)):
        if abs(loop.pv[k] - kept[k - 1]) < band:
            kept[k] = kept[k - 1]
    return replace(loop, pv=kept)


def interpolated(loop: ControlLoop, band: float) -> ControlLoop:
    """The same with straight lines between the samples that were kept, as exports at even times have it."""
    return replace(loop, pv=_straight(loop.pv, band))


def _straight(values: Array, band: float) -> Array:
    kept = [0]
    for k in range(1, len(values)):
        if abs(values[k] - values[kept[-1]]) >= band:
            kept.append(k)
    return np.asarray(np.interp(np.arange(len(values)), kept, values[kept]), float)
