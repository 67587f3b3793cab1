"""An inverse of a backlash whose slope and crossings are learned while it runs (after equation 2.37)."""

from __future__ import annotations

import math

from recordings import BadParameter
from simulator.backlash.lines import check


class AdaptiveBacklashInverse:
    """v = BI(ud) of (2.37) with estimates of m, cl and cr, which the measured output of the backlash corrects.

    The lines are linear in m, m cr and m cl: u = m v - m cr while u rises. So a normalised gradient step on
    u - (m v - m cr) after every move of u makes the distance to the true values smaller, for a gain between 0 and 2;
    while u rests the backlash is in its gap and nothing is learned. What is learned keeps m >= least and cl <= cr.

    slope, left, right : first estimates; gain; least : lower bound of the slope; scale : typical size of v, which
    weighs the crossings against the slope; start : first ud, which is the first output, and v.
    Raises BadParameter for estimates that are no backlash, and for a gain or bound out of range.

    >>> inverse = AdaptiveBacklashInverse(slope=1.0, left=-0.1, right=0.1)
    >>> inverse.update(1.0), inverse.learn(0.6)
    (1.1, None)
    >>> inverse.slope < 1.0, inverse.right > 0.1
    (True, True)
    """

    def __init__(
        self,
        slope: float = 1.0,
        left: float = -0.5,
        right: float = 0.5,
        gain: float = 0.5,
        least: float = 1e-3,
        scale: float = 1.0,
        start: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        check(slope, left, right)
        for name, value, most in (("gain", gain, 2.0), ("least", least, slope), ("scale", scale, math.inf)):
            if not 0 < value < most:
                raise BadParameter(name, f"{value:g}", "it is out of range", f"between 0 and {most:g}")
        self.slope, self._right, self._left = slope, slope * right, slope * left
        self._gain, self._least, self._scale = gain, least, scale
        self._wanted, self.output = start
        self._seen = start[0]

    @property
    def left(self) -> float:
        """The estimated crossing cl."""
        return self._left / self.slope

    @property
    def right(self) -> float:
        """The estimated crossing cr."""
        return self._right / self.slope

    def update(self, value: float) -> float:
        """The input that the estimated backlash needs for its output to move one way to a value."""
        if value != self._wanted:
            self.output = (value + (self._right if value > self._wanted else self._left)) / self.slope
            self._wanted = value
        return self.output

    def learn(self, output: float) -> None:
        """What the backlash answered to the last input."""
        before, self._seen = self._seen, output
        if output == before:
            return
        crossing = self._right if output > before else self._left
        error = output - (self.slope * self.output - crossing)
        weight = self._scale**2
        step = self._gain * error / (self.output**2 + weight)
        self.slope = max(self.slope + step * self.output, self._least)
        if output > before:
            self._right -= step * weight
        else:
            self._left -= step * weight
        if self._left > self._right:
            self._left = self._right = (self._left + self._right) / 2
