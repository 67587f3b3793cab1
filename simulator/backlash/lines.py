"""Backlash with two parallel lines (equation 2.36)."""

from __future__ import annotations

import math

from recordings import BadParameter
from simulator.backlash.play import GeneralisedPlay


class Backlash:
    """u = B(v) of (2.36): along m (v - cr) while v rises, along m (v - cl) while it falls, at rest in between.

    slope : m > 0; left, right : the crossings cl < cr of the v axis; start : first output.
    Raises BadParameter for values that are no backlash.

    >>> gap = Backlash(left=-0.5, right=0.5)
    >>> [gap.update(v) for v in (1.0, 0.2, -1.0)]
    [0.5, 0.5, -0.5]
    """

    def __init__(self, slope: float = 1.0, left: float = -0.5, right: float = 0.5, start: float = 0.0) -> None:
        check(slope, left, right)
        self._play = GeneralisedPlay(lambda v: slope * (v - right), lambda v: slope * (v - left), start)

    def update(self, value: float) -> float:
        """The output after the input moved one way to a value."""
        return self._play.update(value)


def check(slope: float, left: float, right: float) -> None:
    """Raises BadParameter unless slope > 0 and left < right, all of them finite."""
    if not 0 < slope < math.inf:
        raise BadParameter("slope", f"{slope:g}", "it is not a positive number", "m > 0")
    if not -math.inf < left < right < math.inf:
        raise BadParameter("right", f"{right:g}", f"it is not above the left crossing, {left:g}", "c_r > c_l")
