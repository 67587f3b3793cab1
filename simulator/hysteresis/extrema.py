"""What a Preisach model remembers: the alternating dominant extrema of its input (section 2.3.1, wiping-out)."""

from __future__ import annotations

from collections.abc import Iterator


class DominantExtrema:
    """Maxima M_k and minima m_k that no later extremum has exceeded, and the input now.

    low, high : inputs beyond count as these; the start is at low, in negative saturation, and m_0 = low.
    """

    def __init__(self, low: float, high: float) -> None:
        self._low, self._high = low, high
        self.maxima: list[float] = []
        self.minima = [low]
        self.now = low

    def move(self, value: float) -> None:
        """The input moves one way to a value."""
        value = min(max(value, self._low), self._high)
        if value > self.now:
            self._rise(value)
        elif value < self.now:
            self._fall(value)
        self.now = value

    @property
    def falling(self) -> bool:
        """Whether the last move was down: the last extremum is a maximum."""
        return len(self.maxima) == len(self.minima)

    @property
    def memory(self) -> tuple[float, ...]:
        """The dominant extrema, oldest first, without the value of now: all that is left of the past."""
        turns = [self.minima[0]]
        for k, high in enumerate(self.maxima):
            turns += [high, *self.minima[k + 1 : k + 2]]
        return tuple(turns)

    def links(self) -> Iterator[tuple[float, float, float]]:
        """(M_k, m_{k-1}, m_k) of the sums in (2.57) and (2.58), the input now being the last M or m."""
        tops = self.maxima if self.falling else [*self.maxima, self.now]
        yield from zip(tops, self.minima, [*self.minima[1:], self.now], strict=True)

    def strips(self) -> Iterator[tuple[float, float, float]]:
        """(M_{k+1}, M_k, m_k) of the sums in (2.63) and (2.69), from M_0 = high and m_0 = low to M_{n+1} = now."""
        tops = [self._high, *self.maxima, self.now]
        bottoms = [*self.minima, self.now] if self.falling else self.minima
        yield from zip(tops[1:], tops[:-1], bottoms, strict=True)

    def _rise(self, value: float) -> None:
        if self.falling:
            self.minima.append(self.now)
        while self.maxima and value >= self.maxima[-1]:  # wiping out
            del self.maxima[-1], self.minima[-1]

    def _fall(self, value: float) -> None:
        if not self.falling:
            self.maxima.append(self.now)
        while len(self.minima) > 1 and value <= self.minima[-1]:
            del self.maxima[-1], self.minima[-1]
