"""An inverse of Tao and Kokotovic's hysteresis whose lines are learned while it runs (after equation 2.45)."""

from __future__ import annotations

import math

from recordings import BadParameter
from simulator.hysteresis.quadrilateral import Lines

FLAT, STEEP = ("t", "b"), ("r", "l")


class AdaptiveQuadrilateralInverse:
    """v = HI(ud) of (2.45) with estimates of the eight parameters, which the measured output corrects.

    Every line is linear in its slope and its height at v = 0. After every move a normalised gradient step corrects the
    line on which the estimated hysteresis has gone: its height and slope from u itself, or on a branch inside the loop
    the slope alone, from what u moved. Slopes stay on their side of `between`, so that the lines keep their order.

    lines : first estimates mt, ct, mb, cb, mr, cr, ml, cl; gain : between 0 and 2; between : a slope that is above
    those of top and bottom and below those of the sides; scale : typical size of v; start : first ud and v.
    Raises BadParameter for a gain out of range and a `between` that does not lie between, and as `Quadrilateral`.
    """

    def __init__(
        self,
        *,
        gain: float = 0.5,
        between: float | None = None,
        scale: float = 1.0,
        start: tuple[float, float] = (0.0, 0.0),
        **lines: float,
    ) -> None:
        k = Lines(**lines).enclosing()
        low, high = max(k.mt, k.mb), min(k.mr, k.ml)
        self._between = math.sqrt(low * high) if between is None else between
        if not low < self._between < high:
            raise BadParameter("between", f"{between:g}", "it is no slope between", f"from {low:g} to {high:g}")
        if not 0 < gain < 2:
            raise BadParameter("gain", f"{gain:g}", "it is out of range", "between 0 and 2")
        self._gain, self._scale = gain, scale
        self._slope = {"t": k.mt, "b": k.mb, "r": k.mr, "l": k.ml}
        self._height = {"t": k.ct, "b": k.cb, "r": -k.mr * k.cr, "l": -k.ml * k.cl}
        self._wanted, self.output = start
        self._came, self._seen = start[1], start[0]
        self._line, self._inside = "", False

    @property
    def lines(self) -> Lines:
        """The lines as estimated now."""
        m, h = self._slope, self._height
        return Lines(m["t"], h["t"], m["b"], h["b"], m["r"], -h["r"] / m["r"], m["l"], -h["l"] / m["l"])

    def update(self, value: float) -> float:
        """The input that the estimated hysteresis needs for its output to move one way to a value."""
        moved = value - self._wanted
        self._came = self.output
        if moved:
            flat, side, end = ("b", "r", "t") if moved > 0 else ("t", "l", "b")
            inside = self.output + moved / self._slope[flat]
            at = {line: (value - self._height[line]) / self._slope[line] for line in (side, end)}
            least, most = (min, max) if moved > 0 else (max, min)
            self.output = most(least(inside, at[side]), at[end])
            self._inside = self.output == inside
            self._line = flat if self._inside else side if self.output == at[side] else end
            self._wanted = value
        else:
            self._line = ""
        return self.output

    def learn(self, output: float) -> None:
        """What the hysteresis answered to the last input."""
        before, self._seen = self._seen, output
        if not self._line:
            return
        line, v, moved = self._line, self.output, self.output - self._came
        if self._inside:
            error = output - before - self._slope[line] * moved
            self._slope[line] += self._gain * error * moved / (moved**2 + self._scale**2)
        else:
            error = output - self._slope[line] * v - self._height[line]
            step = self._gain * error / (v**2 + self._scale**2)
            self._slope[line] += step * v
            self._height[line] += step * self._scale**2
        tiny = 1e-6 * self._between
        low, high = (tiny, self._between - tiny) if line in FLAT else (self._between + tiny, math.inf)
        self._slope[line] = min(max(self._slope[line], low), high)
