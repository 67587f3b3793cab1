"""The smooth sign of (4.17), and the implicit step through it that keeps any sampling time stable."""

from __future__ import annotations

from math import fabs, tanh

from detector.arithmetic.native import inlined, native

TANH, SAT = 0.0, 1.0
_MOST_STEPS = 60
_NEAR = 4e-16


@native
def sigm(xi: float, delta: float, kind: float) -> float:
    """tanh(xi / delta), or xi / delta cut at -1 and 1."""
    if kind == TANH:
        return tanh(xi / delta)
    return min(max(xi / delta, -1.0), 1.0)


@inlined
def saturated_root(c: float, h: float, delta: float) -> float:
    """The root of xi + h sat(xi / delta) = c for h >= 0; for h < 0 one that lies beyond delta."""
    xi = c * delta / (delta + h)
    if fabs(xi) > delta or h < 0.0:
        xi = c - h if c > 0.0 else c + h
    return xi


@native
def solve(c: float, h: float, delta: float, kind: float) -> float:
    """The root xi of xi + h sigm(xi / delta) = c.

    The saturation has it in closed form, which is also where the search for tanh starts: Newton, and bisection where
    Newton leaves the bracket c - h .. c + h. For h < 0, possible only under the printed law, a root is not unique.
    """
    xi = saturated_root(c, h, delta)
    if kind == SAT and h >= 0.0:
        return xi
    low, high = c - fabs(h), c + fabs(h)
    for _ in range(_MOST_STEPS):
        s = sigm(xi, delta, kind)
        miss = xi + h * s - c
        if miss > 0.0:
            high = xi
        else:
            low = xi
        slope = 1.0 + h * (1.0 - s * s) / delta
        new = xi - miss / slope if slope != 0.0 else low
        if not low <= new <= high:
            new = 0.5 * (low + high)
        done = fabs(new - xi) <= _NEAR * (fabs(c) + fabs(h))
        xi = new
        if done:
            break
    return xi
