"""What the data of a simulated sticky loop tell at most, by the true course of its valve, which no method has.

A loop counts as told when that course explains PV so much better than a linear process of high order, and than the best
backlash, that twice the logarithm of the likelihoods differs by more than `TOLD`: odds of 20,000 to 1.
"""

from __future__ import annotations

from identification.loops import SimulatedLoop, told_by_place

TOLD = 20.0


def told(known: SimulatedLoop) -> tuple[float, float]:
    """Twice the logarithms of the likelihoods over those of both rivals; zeros for a valve that does not stick."""
    return told_by_place(known.loop, known.place) if known.cause == "stiction" else (0.0, 0.0)


def hidden_by_positioner(known: SimulatedLoop, shown: tuple[float, float] | None = None) -> bool:
    """Whether a positioner keeps what its sticking stem does from the loop. shown : as of `told`, where it is known."""
    if known.valve != "positioned" or known.cause != "stiction":
        return False
    return min(told(known) if shown is None else shown) <= TOLD
