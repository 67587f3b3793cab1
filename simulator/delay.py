"""The actuating force some time ago: what a kernel with a dead time is driven with beside the force itself."""

from __future__ import annotations

import numpy as np

from recordings import Array

LONGEST = 10.0
"""Longest dead time [s]: positioners with a slow supply or a long signal line take seconds."""


def delay_columns(t: Array, u: Array, tau: float, hold: bool) -> Array:
    """Two inputs (n_samples, 2) from which a kernel computes u(t - tau) - u(t) and its derivative by tau.

    With b = du/dt (t - tau) they are a = u(t - tau) - u(t) + b tau and b; a - b tau is the difference and -b its
    derivative. Before the first sample u is what it is there. Between samples u is a cubic through them whose slopes
    are central differences, so u(t - tau) is smooth in tau; where u is held it is the mean of the held values over the
    sample that follows t - tau, so that a sample gets the impulse it should.

    >>> a, b = delay_columns(np.arange(5.0), 2 * np.arange(5.0), 0.5, hold=False).T
    >>> (a - 0.5 * b)[2:].tolist(), b[2:].tolist()
    ([-1.0, -1.0, -1.0], [2.0, 2.0, 2.0])
    """
    if len(t) < 2:
        return np.zeros((len(t), 2))
    then = np.maximum(t - tau, t[0])
    if hold:
        into = np.clip(np.searchsorted(t, then), 1, len(t) - 1) - 1
        value, slope = np.interp(then, t, u), (np.diff(u) / np.diff(t))[into]
    else:
        from scipy.interpolate import CubicHermiteSpline  # half of what a command's start would take, for one effect

        curve = CubicHermiteSpline(t, u, np.gradient(u, t))
        value, slope = curve(then), curve(then, 1)
    slope = np.where(then > t[0], slope, 0.0)
    return np.column_stack([value - u + slope * tau, slope])
