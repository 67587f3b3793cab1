"""The classical Preisach model in its numerical form (equation 2.52-2.58)."""

from __future__ import annotations

from collections.abc import Callable


class Preisach:
    """f = sum of relays of weight mu(alpha, beta) (2.52), by first-order curves and dominant extrema (2.57, 2.58).

    curves : F(alpha, beta) of (2.54), half of what the output falls from the ascending branch at alpha to beta; it is
    the weight in the triangle between the two, so F(a, a) = 0; low, high : beta0 and alpha0, between which the weight
    lies: inputs beyond count as these. It starts in negative saturation, at low. Raises ValueError unless low < high.

    >>> even = Preisach(lambda a, b: (a - b) ** 2 / 2, 0.0, 1.0)
    >>> [even.update(u) for u in (0.0, 1.0, 0.5, 1.0)]
    [-0.5, 0.5, 0.25, 0.5]
    """

    def __init__(self, curves: Callable[[float, float], float], low: float, high: float) -> None:
        if not low < high:
            raise ValueError(f"low {low:g}, high {high:g}: low is less than high")
        self._curves, self._low, self._high = curves, low, high
        self._maxima: list[float] = []
        self._minima = [low]
        self._input = low

    def update(self, value: float) -> float:
        """The output after the input moved one way to a value."""
        value = min(max(value, self._low), self._high)
        if value > self._input:
            self._rise(value)
        elif value < self._input:
            self._fall(value)
        self._input = value
        return self._output()

    @property
    def memory(self) -> tuple[float, ...]:
        """The dominant extrema, oldest first, without the value of now: all that is left of the past."""
        turns = [self._minima[0]]
        for high, low in zip(self._maxima, [*self._minima[1:], None], strict=False):
            turns += [high] if low is None else [high, low]
        return tuple(turns)

    @property
    def _falling(self) -> bool:
        return len(self._maxima) == len(self._minima)

    def _rise(self, value: float) -> None:
        if self._falling:
            self._minima.append(self._input)
        while self._maxima and value >= self._maxima[-1]:  # wiping out
            del self._maxima[-1], self._minima[-1]

    def _fall(self, value: float) -> None:
        if not self._falling:
            self._maxima.append(self._input)
        while len(self._minima) > 1 and value <= self._minima[-1]:
            del self._maxima[-1], self._minima[-1]

    def _output(self) -> float:
        F, now = self._curves, self._input
        tops = self._maxima if self._falling else [*self._maxima, now]
        bottoms = [*self._minima[1:], now]
        links = zip(tops, self._minima, bottoms, strict=True)
        return -F(self._high, self._low) + 2 * sum(F(top, before) - F(top, after) for top, before, after in links)
