"""Chua and Stromsmoe's model of a hysteresis loop as a differential equation (equation 2.46-2.51)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from recordings import Array, BadParameter

Function = Callable[[Array], Array]
TABLE = 4001
"""Points at which f and h are kept, linear between: errors of 1e-7 of their bend."""


def identity(d: Array) -> Array:
    """The simplest dissipation function g."""
    return d


def one(y: Array) -> Array:
    """The simplest weighting function h."""
    return np.ones_like(y)


class ChuaStromsmoe:
    """dy/dt = h(y) g(x - f(y)) (2.46), or dy/dt = w(dx/dt) h(y) g(x - f(y)) (2.51) where w is given.

    restoring : f, rising, of an array y; dissipation : g, rising, odd, of an array; weighting : h > 0 of an array y;
    rate : w >= 0 of dx/dt, 0 only at 0; with w = abs the loop is the same at every frequency. Output y and time are in
    the units of what is given. What f, g and h may be is checked where the input reaches.
    """

    def __init__(
        self,
        restoring: Function,
        dissipation: Function = identity,
        weighting: Function = one,
        rate: Function | None = None,
    ) -> None:
        self._f, self._g, self._h, self._w = restoring, dissipation, weighting, rate

    @property
    def restoring(self) -> Function:
        """f, as given or as found from a loop."""
        return self._f

    @property
    def weighting(self) -> Function:
        """h, as given or as found from a loop."""
        return self._h

    def follow(self, time: ArrayLike, input: ArrayLike, start: float) -> Array:
        """The output y (n_samples) from y = start on, for an input x (n_samples), linear between its samples.

        time (n_samples) [s], rising. By RK4 with steps as short as its time constant needs.
        Raises BadParameter for rows that differ or times that do not rise, and where f or g does not rise or h is not
        positive on the way.
        """
        t, x = _rows(time, input)
        return self._solver(t, x, *self._bounds(x, start))(start)

    def periodic(self, time: ArrayLike, input: ArrayLike) -> Array:
        """The one periodic solution y (n_samples) of a periodic input (n_samples), whose last sample is its first.

        Properties 2 and 3: every solution approaches it. Raises BadParameter as `follow`, and for an input that does
        not end as it began.
        """
        t, x = _rows(time, input)
        if abs(x[-1] - x[0]) > 1e-9 * np.ptp(x):
            raise BadParameter("input", x[-1], f"it begins at {x[0]:g}", "give a whole period")
        low, high = self._bounds(x)
        if high - low < 1e-300:
            return np.full_like(x, low)
        solve = self._solver(t, x, low, high)
        return solve(brentq(lambda y: solve(y)[-1] - y, low, high, xtol=1e-10 * (high - low)))

    def input_of(self, output: ArrayLike, speed: ArrayLike, dissipated: Function) -> Array:
        """The input x (n_samples) that makes an output y of rate dy/dt (n_samples) by (2.48); dissipated : g^-1."""
        y, dy = np.asarray(output, dtype=float), np.asarray(speed, dtype=float)
        return dissipated(dy / self._h(y)) + self._f(y)

    @classmethod
    def of_cosine_loop(
        cls, time: ArrayLike, input: ArrayLike, output: ArrayLike, dissipation: Function = identity, points: int = 60
    ) -> ChuaStromsmoe:
        """f and h from one period of a measured loop whose output y is a cosine, for a chosen g (2.48-2.50).

        f is the middle of the loop along x, and h = (dy/dt)/g(d), d half its width (`points` of them between the ends,
        smooth between and carried on beyond: f straight, h level). For that loop the model is exact.
        Raises BadParameter for an output that is no whole period of a cosine, a loop run through the other way, a loop
        whose middle is not monotone, and a g that is not odd and rising over its width.
        """
        t, x = _rows(time, input)
        y = np.asarray(output, dtype=float)
        middle, amplitude, phase = _cosine(t, y)
        period = t[-1] - t[0]
        at = middle + amplitude * np.cos(np.pi * (np.arange(points) + 0.5) / points)[::-1]
        angle = np.arccos((at - middle) / amplitude)
        rising, falling = (
            np.interp(t[0] + np.mod(way * angle - phase, 2 * np.pi) / (2 * np.pi) * period, t, x) for way in (-1, 1)
        )
        half = (rising - falling) / 2
        if not (half > 0).all():
            raise BadParameter("input", "", "the branch that rises is not right of the other", "check signs and order")
        f, g = (rising + falling) / 2, np.asarray(dissipation(half), dtype=float)
        if not (np.diff(f) > 0).all():
            raise BadParameter("input", "", "the middle of the loop is not monotone, so f does not rise", "f' > 0")
        order = np.argsort(half)
        odd = np.allclose(dissipation(-half), -g, rtol=1e-9, atol=0)
        if not odd or not (g > 0).all() or (np.diff(g[order]) < 0).any():
            raise BadParameter("dissipation", "", "g is not odd and rising", "g' > 0 and g(-d) = -g(d)")
        speed = 2 * np.pi / period * np.sqrt(amplitude**2 - (at - middle) ** 2)
        return cls(_carried_on(at, f, straight=True), dissipation, _carried_on(at, speed / g, straight=False))

    def _bounds(self, x: Array, *starts: float) -> tuple[float, float]:
        """Least and largest y on the way: where f(y) is the least and the largest x, and the start (property 1)."""
        ends = [self._inverse(float(x.min())), self._inverse(float(x.max())), *starts]
        return min(ends), max(ends)

    def _inverse(self, x: float) -> float:
        reach = 1.0
        while not float(self._f(np.array(-reach))) <= x <= float(self._f(np.array(reach))):
            reach *= 2
            if reach > 1e30:
                raise BadParameter("restoring", "", f"f never has the value {x:g}", "f maps onto all inputs")
        return float(brentq(lambda y: float(self._f(np.array(y))) - x, -reach, reach))

    def _solver(self, t: Array, x: Array, low: float, high: float) -> Callable[[float], Array]:
        """From a start to the solution, with tables of f, g and h where y can come."""
        from simulator.hysteresis import chua_loop

        room = 1e-6 * (1 + abs(low) + abs(high)) + 0.01 * (high - low)
        span = np.array([low - room, high + room])
        y = np.linspace(span[0], span[1], TABLE)
        f, h = np.asarray(self._f(y), dtype=float), np.asarray(self._h(y), dtype=float)
        if not (np.diff(f) > 0).all():
            raise BadParameter("restoring", "", f"f does not rise between {low:g} and {high:g}", "f' > 0")
        if not (h > 0).all():
            raise BadParameter("weighting", f"{h.min():g}", "h is not positive", "0 < a <= h < b")
        reach = float(max(x.max() - f[0], f[-1] - x.min()))
        d = np.linspace(-reach, reach, 2 * TABLE - 1)
        g = np.asarray(self._g(d), dtype=float)
        if not (np.diff(g) > 0).all():
            raise BadParameter("dissipation", "", f"g does not rise between {-reach:g} and {reach:g}", "g' > 0")
        paces = np.ones(len(t) - 1) if self._w is None else np.asarray(self._w(np.diff(x) / np.diff(t)), dtype=float)
        if not (paces >= 0).all():
            raise BadParameter("rate", f"{paces.min():g}", "w is negative", "w(dx/dt) >= 0")

        def solved(start: float) -> Array:
            out = np.empty_like(t)
            chua_loop.solve(t, x, paces, start, span, f, h, reach, g, out)
            return out

        return solved


def _rows(time: ArrayLike, input: ArrayLike) -> tuple[Array, Array]:
    t, x = np.asarray(time, dtype=float), np.asarray(input, dtype=float)
    if t.shape != x.shape or t.ndim != 1 or len(t) < 2 or not np.isfinite(x).all() or not (np.diff(t) > 0).all():
        raise BadParameter("time", t.shape, f"it does not rise beside inputs {x.shape}", "give equal rows, two or more")
    return t, x


def _cosine(t: Array, y: Array) -> tuple[float, float, float]:
    """Middle, amplitude and phase of y = middle + amplitude cos(angle + phase), the angle 2 pi over the whole time."""
    if y.shape != t.shape or not np.isfinite(y).all():
        raise BadParameter("output", y.shape, f"beside times {t.shape}", "give equal rows")
    angle = 2 * np.pi * (t - t[0]) / (t[-1] - t[0])
    columns = np.column_stack([np.ones_like(t), np.cos(angle), np.sin(angle)])
    (middle, c, s), *_ = np.linalg.lstsq(columns, y, rcond=None)
    amplitude = float(np.hypot(c, s))
    off = float(np.abs(columns @ [middle, c, s] - y).max())
    if not off < 1e-2 * amplitude:
        raise BadParameter(
            "output", f"{off:g}", f"it is that far off a cosine of {amplitude:g}", "give one whole period"
        )
    return float(middle), amplitude, float(np.arctan2(-s, c))


def _carried_on(at: Array, values: Array, straight: bool) -> Function:
    inner = PchipInterpolator(at, values)
    low, high = (float(inner(end, 1)) if straight else 0.0 for end in (at[0], at[-1]))

    def function(y: Array) -> Array:
        near = np.clip(y, at[0], at[-1])
        return inner(near) + low * np.minimum(y - at[0], 0) + high * np.maximum(y - at[-1], 0)

    return function
