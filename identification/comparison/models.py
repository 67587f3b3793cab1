"""Two models compared, parameter by parameter, by their standard deviations."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from identification.comparison.result import (
    ComparedCurve,
    ComparedPicture,
    ComparedValue,
    ComparisonResult,
    Difference,
    shared_tag,
)
from recordings import Array
from simulator import ValveModel

LEVEL = 0.01
"""Probability that any parameter is called changed where none is."""
STEADY = ("lugre.fc", "lugre.fs", "lugre.vs", "lugre.sigma2")
"""Parameters of the steady friction."""
FASTEST = 20.0
"""Highest speed of the friction curves that are drawn, in Stribeck velocities."""


def model_comparison(
    before: ValveModel, after: ValveModel, names: tuple[str, str], repeatability: float = 0.0
) -> ComparisonResult:
    """Two models of one valve; names : of their files; repeatability : share by which a parameter differs from test to
    test of a valve that has not changed, as a standard deviation, beside that of the fit.
    """
    shared = [name for name in before.parameters if name in after.parameters]
    told = [n for n in shared if before.parameters[n].std is not None and after.parameters[n].std is not None]
    reach = float(norm.isf(LEVEL / 2 / max(len(told), 1)))
    found = []
    for name in told:
        first, last = (_estimate(model, name, repeatability) for model in (before, after))
        half = reach * float(np.hypot(first.std, last.std))
        difference = last.value - first.value
        unit = before.parameters[name].unit
        found.append(Difference(name, unit, first, last, difference - half, difference + half))
    notes = list(_notes(before, after, [n for n in shared if n not in told]))
    pictures = tuple(_pictures(before, after, names))
    return ComparisonResult(
        "models",
        *names,
        tuple(found),
        (),
        tuple(notes),
        pictures,
        LEVEL,
        True,
        shared_tag(before.plant, after.plant),
    )


def _estimate(model: ValveModel, name: str, share: float) -> ComparedValue:
    p = model.parameters[name]
    return ComparedValue(p.value, float(np.hypot(p.std or 0.0, share * abs(p.value))))


def _notes(before: ValveModel, after: ValveModel, untold: list[str]) -> list[str]:
    notes = []
    for one, other, word in ((after, before, "after"), (before, after, "before")):
        alone = [e for e in one.effects if e not in other.effects]
        if alone:
            notes.append(f"Only the model {word} has {', '.join(alone)}.")
    if untold:
        notes.append(f"Not compared, for at least one model does not tell them: {', '.join(untold)}.")
    return notes


def _pictures(before: ValveModel, after: ValveModel, names: tuple[str, str]) -> list[ComparedPicture]:
    if not all(name in model.values for model in (before, after) for name in STEADY):
        return []
    curves = [[_steady(model.values, name)] for model, name in zip((before, after), names, strict=True)]
    return [ComparedPicture("Steady friction against speed", "velocity [mm/s]", "friction [N]", *curves)]


def _steady(values: dict[str, float], name: str) -> ComparedCurve:
    """The steady friction of LuGre (2.18) up to `FASTEST` Stribeck velocities."""
    fc, fs, vs, s2 = (values[name] for name in STEADY)
    v: Array = np.linspace(0.0, FASTEST * vs, 400)
    return ComparedCurve(name, 1e3 * v, fc + (fs - fc) * np.exp(-((v / vs) ** 2)) + s2 * v)
