"""What is wrong with the data before anything is said of the valve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from identification.loops.loop import ControlLoop
from identification.loops.oscillation import Oscillation
from recordings import Array

REPEATED = 0.2
"""Share of repeated or interpolated samples from which a column counts as compressed."""
COARSE = 0.05
"""A quantisation step below this share of a column's standard deviation does no harm."""
SATURATED, MANUAL = 0.1, 0.3
FEWEST_CYCLES, FEWEST_PER_CYCLE = 10.0, 10.0


Hidden = Literal["nothing", "shape", "everything"]
"""Without the shape of the signals the search for S and J is left, which can find stiction but not exclude it; with
everything hidden the answer is `cannot_tell`."""


@dataclass(frozen=True)
class DataProblem:
    """words : a sentence; hides : what of the valve cannot be seen; cause : what it is evidence of."""

    words: str
    hides: Hidden = "nothing"
    cause: str | None = None


def data_problems(loop: ControlLoop, oscillations: tuple[Oscillation, ...]) -> tuple[DataProblem, ...]:
    """Everything that limits the answer."""
    found = [*_compressed(loop), *_saturated(loop), *_stopped(loop)]
    if loop.gaps:
        words = f"gaps between samples: {loop.gaps}; the longest stretch without one is used"
        found.append(DataProblem(words))
    elif loop.missing:
        words = f"{100 * loop.missing:.2g} % of the samples have no number: the others are taken"
        found.append(DataProblem(words))
    if oscillations:
        cycles, each = len(loop.pv) * loop.dt / oscillations[0].period_s, oscillations[0].period_s / loop.dt
        if cycles < FEWEST_CYCLES:
            found.append(DataProblem(f"{cycles:.1f} cycles are fewer than ten", "shape"))
        if each < FEWEST_PER_CYCLE:
            found.append(DataProblem(f"{each:.1f} samples a cycle are fewer than ten", "shape"))
    else:
        found.append(DataProblem("the loop does not oscillate regularly", "shape"))
    if loop.sp is not None and np.mean(np.diff(loop.sp) != 0) > 0.2:
        found.append(DataProblem("the set point moves in most samples: the loop is the inner one of a cascade"))
    if loop.sp is None:
        found.append(DataProblem("no set point: it is taken as constant"))
    if loop.kind is None:
        found.append(DataProblem("the kind of loop is not known: it is taken as self-regulating"))
    return tuple(found)


def _everything(hidden: bool | np.bool_) -> Hidden:
    return "everything" if hidden else "nothing"


def _compressed(loop: ControlLoop) -> list[DataProblem]:
    """Historians keep a sample only when it leaves a dead band, and repeat or interpolate what they left out."""
    found = []
    moving = np.diff(loop.pv)[1:] != 0  # the PI output is a straight line while the error is constant
    rough = np.abs(np.diff(loop.op, 3, append=loop.op[-1])) > 1e-8 * float(np.ptp(loop.op))
    bends = rough if loop.integrating else np.ones(len(rough), bool)  # a level runs straight while the valve sticks
    for name, values, free in (("PV", loop.pv, bends), ("OP", loop.op, moving)):
        change = np.diff(values)
        held = float(np.mean(change == 0))
        scale = max(float(np.ptp(values)), 1e-300)
        bent = np.abs(np.diff(change)) > 1e-9 * scale
        straight = float(np.mean(~bent & free & (np.abs(change[1:]) > 1e-9 * scale)))
        quantum = _quantum(change, scale)
        if quantum > COARSE * float(np.std(values)):
            words = f"{name} is quantised in steps of {quantum:.3g}, {quantum / np.std(values):.2g} standard deviations"
            found.append(DataProblem(words, _everything(quantum > 0.3 * float(np.std(values)))))
        elif held > REPEATED and not quantum and _leaps(change):
            words = f"{name} is compressed: {100 * held:.0f} % of its samples repeat the one before"
            found.append(DataProblem(words, "everything"))
        elif straight > REPEATED:
            words = f"{name} is compressed: {100 * straight:.0f} % of its samples are interpolated on straight lines"
            found.append(DataProblem(words, "everything"))
    return found


def _leaps(change: Array) -> bool:
    """Whether changes that are not zero are all large, as those that leave a dead band are."""
    moved = np.abs(change[change != 0])
    return len(moved) > 0 and float(np.quantile(moved, 0.05)) > 0.25 * float(np.median(moved))


def _quantum(change: Array, scale: float) -> float:
    """The step of which all changes are whole multiples; 0 where there is none."""
    moved = np.abs(change[np.abs(change) > 1e-9 * scale])
    if len(moved) < 5:
        return 0.0
    least = float(np.quantile(moved, 0.01))
    whole = moved / least
    return least if float(np.mean(np.abs(whole - np.round(whole)) < 0.02)) > 0.98 else 0.0


def _saturated(loop: ControlLoop) -> list[DataProblem]:
    """OP at an end of its range, where it stays."""
    span = float(np.ptp(loop.op))
    ends = [np.mean(np.abs(loop.op - end) < 1e-6 * span) for end in (loop.op.min(), loop.op.max())]
    share = float(max(ends))
    if share < SATURATED:
        return []
    words = f"OP is at an end of its range in {100 * share:.0f} % of the samples: saturation"
    return [DataProblem(words, _everything(share > 3 * SATURATED), "saturation")]


def _stopped(loop: ControlLoop) -> list[DataProblem]:
    """OP held for long while PV moves: manual mode."""
    runs = np.diff(np.flatnonzero(np.concatenate([[True], np.diff(loop.op) != 0, [True]])))
    longest = float(runs.max()) / len(loop.op)
    if longest < MANUAL:
        return []
    words = f"OP stands still for {100 * longest:.0f} % of the time: the loop was in manual mode"
    return [DataProblem(words, "everything")]
