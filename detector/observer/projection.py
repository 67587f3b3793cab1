"""Projection of the adaptive laws (4.20) onto their sets: balls for the weights, intervals for the parameters.

The sets are about zero, or about what the parameters start from: the laws can then follow so far and no further.

Radial: where a step leaves the set it is put back on the border along the radius, the discrete form of switching the
outward component off. Smooth: within a layer below the border the outward component is faded out, so that the law is
Lipschitz (Pomet and Praly 1992); a rest beyond the border, due to the finite step, is put back radially.
"""

from __future__ import annotations

from math import fabs, sqrt

from detector.arithmetic.native import inlined, native
from recordings import Array

RADIAL, SMOOTH = 0.0, 1.0
LAYER = 0.1
"""Thickness of the smooth form's layer, as a share of the bound."""


@native
def project_ball(value: Array, step: Array, centre: Array, bound: float, kind: float) -> None:
    """value (n,) becomes P{value + step} with abs(value - centre) <= bound; in place."""
    if kind == SMOOTH:
        _fade(value, step, centre, bound)
    size = 0.0
    for i in range(value.shape[0]):
        value[i] += step[i]
        away = value[i] - centre[i]
        size += away * away
    if size > bound * bound:
        scale = bound / sqrt(size)
        for i in range(value.shape[0]):
            value[i] = centre[i] + scale * (value[i] - centre[i])


@native
def _fade(value: Array, step: Array, centre: Array, bound: float) -> None:
    """Take from the step its outward component, by the share of the layer that is used up."""
    size, outward = 0.0, 0.0
    for i in range(value.shape[0]):
        size += (value[i] - centre[i]) * (value[i] - centre[i])
        outward += (value[i] - centre[i]) * step[i]
    used = (sqrt(size) - (1.0 - LAYER) * bound) / (LAYER * bound)
    if used > 0.0 and outward > 0.0:
        for i in range(value.shape[0]):
            step[i] -= min(used, 1.0) * outward / size * (value[i] - centre[i])


@inlined
def project_interval(value: float, step: float, centre: float, bound: float, least: float, kind: float) -> float:
    """P{value + step} with abs(value - centre) <= bound, at least `least`; the smooth form fades towards the ends."""
    away = value - centre
    if kind == SMOOTH and away * step > 0.0:
        step *= max(0.0, min((bound - fabs(away)) / (LAYER * bound), 1.0))
    return min(max(value + step, centre - bound, least), centre + bound)
