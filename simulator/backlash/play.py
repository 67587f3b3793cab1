"""The generalised play: any two rising curves instead of two parallel lines."""

from __future__ import annotations

from collections.abc import Callable

from recordings import BadParameter

Curve = Callable[[float], float]


class GeneralisedPlay:
    """An output that rests until the input pushes it along a rising curve, or pulls it along another one above.

    push, pull : the curves followed while the input rises and falls, push(v) <= pull(v); start : first output, which
    the first update moves between the curves. (2.36) is push(v) = m (v - cr), pull(v) = m (v - cl).

    >>> soft = GeneralisedPlay(lambda v: v - 0.1 * abs(v), lambda v: v + 0.1 * abs(v))
    >>> [soft.update(v) for v in (1.0, 0.9, 0.5)]
    [0.9, 0.9, 0.55]
    """

    def __init__(self, push: Curve, pull: Curve, start: float = 0.0) -> None:
        self._push, self._pull, self.output = push, pull, start

    def update(self, value: float) -> float:
        """The output after the input moved one way to a value. Raises BadParameter where the curves have crossed."""
        low, high = self._push(value), self._pull(value)
        if not low <= high:
            found = f"it is {low:g} at {value:g}, above pull, {high:g}: the curves have crossed"
            raise BadParameter("push", "", found, "push(v) <= pull(v)")
        self.output = min(max(self.output, low), high)
        return self.output
