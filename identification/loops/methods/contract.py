"""What a method is: one file with one function, from a prepared loop to an answer with its reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from recordings import Array

Says = Literal["stiction", "no_stiction", "undecided", "not applicable"]


@dataclass(frozen=True)
class Cycles:
    """A loop made ready: evenly sampled so that a cycle has about thirty samples, arrays (n,) without mean and trend.

    pv, op : scaled to a standard deviation of 1; period : samples a cycle; integrating, flow, gas : what is known of
    the process, of the last one that it may be compressible.
    """

    pv: Array
    op: Array
    error: Array
    period: float
    integrating: bool
    flow: bool
    gas: bool = False


@dataclass(frozen=True)
class MethodAnswer:
    """method : its id; value : its index, None where it has none; says : its own verdict; why : in a sentence."""

    method: str
    value: float | None
    says: Says
    why: str


Method = Callable[[Cycles], MethodAnswer]


def judged(method: str, value: float | None, low: float, high: float, index: str) -> MethodAnswer:
    """The answer of an index whose paper calls it stiction above `high` and none below `low`."""
    if value is None or value != value:
        return MethodAnswer(method, None, "undecided", f"{index} cannot be computed: too few clear half cycles")
    says: Says = "stiction" if value > high else "no_stiction" if value < low else "undecided"
    return MethodAnswer(method, float(value), says, f"{index} {value:.3g}; stiction above {high:g}, none below {low:g}")


def inapplicable(method: str, why: str) -> MethodAnswer:
    """The answer of a method that is not made for such a loop."""
    return MethodAnswer(method, None, "not applicable", why)
