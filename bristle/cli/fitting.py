"""The options of `bristle fit` turned into what the identification takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rich.status import Status

from recordings import BadInput, Progress, Recording

if TYPE_CHECKING:
    from rich.console import Console

    from identification import Estimator, Identification
    from simulator import Causality

LEFT_OUT = {"spring": {"spring.K": 0.0}}
"""Effects that a plant may lack, as the values that say so. The constant force F0 stays: weight, offset, drive zero."""


def without_effects(names: Sequence[str]) -> dict[str, float]:
    """Held values that stand for left-out effects. Raises BadInput for one that cannot be left out."""
    held: dict[str, float] = {}
    for name in names:
        if name not in LEFT_OUT:
            raise BadInput(f"--without {name}", "it cannot be left out", f"there are {', '.join(LEFT_OUT)}")
        held |= LEFT_OUT[name]
    return held


def free_parameters(names: Sequence[str], held: Mapping[str, float]) -> list[str]:
    """The names to profile. Raises BadInput for one that the base model has not, or that is held."""
    from simulator import BASE, CATALOGUE

    free = [name for effect in BASE for name in CATALOGUE[effect].parameter_names() if name not in held]
    for name in names:
        if name not in free:
            raise BadInput(f"--profile {name}", "it is no free parameter of this fit", f"there are {', '.join(free)}")
    return list(names)


def with_area(recordings: Sequence[Recording], area: float | None) -> list[Recording]:
    """The recordings with a diaphragm area [m2] set. Raises BadInput for one that is not positive."""
    if area is None:
        return list(recordings)
    return [replace(r, plant=replace(r.plant, diaphragm_area_m2=area)) for r in recordings]


def checked_estimator(text: str) -> Estimator:
    """The estimator named on the command line. Raises BadInput for an unknown one."""
    known: tuple[Estimator, ...] = ("auto", "output-error", "noise-aware")
    for name in known:
        if text == name:
            return name
    raise BadInput(f"--estimator {text}", "there is none of that name", "write auto, output-error or noise-aware")


def checked_causality(text: str | None) -> Causality | None:
    """The causality named on the command line. Raises BadInput for an unknown one."""
    if text is None:
        return None
    if text == "force":
        return "force"
    if text == "motion":
        return "motion"
    raise BadInput(f"--causality {text}", "it is neither", "write force (force in, position out) or motion")


def print_profiles(console: Console, found: Identification, names: Sequence[str]) -> None:
    """The profile likelihoods of some parameters."""
    from identification import profile

    for name in names:
        p = profile(found.fit, found.uncertainty, name)
        low, high = (f"{x:.6g}" if x is not None else "(no end found)" for x in (p.lower, p.upper))
        console.print(f"profile of {name}: 90 % interval from {low} to {high}")


def counted(status: object) -> Progress:
    """Shows on a terminal's status what is being done, and how much of it is."""

    def report(stage: str, done: int, total: int) -> None:
        if isinstance(status, Status):
            status.update(f"{stage}: {done} of {total}" if total else stage)

    return report
