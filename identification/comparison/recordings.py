"""Two recordings compared by their signatures: friction, spring rate and preload, and where friction changed.

Each difference is judged by what strokes of the same recording differ by (Welch's test; Biometrika 34, 1947), at a
level that holds for all quantities and places together (Bonferroni).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.stats import t as student

from identification.comparison.result import (
    ComparedCurve,
    ComparedPicture,
    ComparedValue,
    ComparisonResult,
    Difference,
    shared_tag,
)
from identification.comparison.signature import Signature, line, signature, travel
from identification.data.experiment import Experiment
from recordings import Array, NegativeAnswer

LEVEL = 0.01
"""Probability that anything is called changed where nothing is, by half for the quantities and for the places."""
SHARED = 0.3
"""Share of the longer travel that both recordings have in common at least."""
UNLIKE = 1.5
"""Ratio of the speeds, and of the shares of time in motion, from which two tests are not alike: viscous friction, and
rests below break-away, then look like a change."""


def recording_comparison(before: Experiment, after: Experiment, repeatability: float = 0.0) -> ComparisonResult:
    """Two recordings of one valve. repeatability : share by which friction, spring rate and preload differ from test to
    test of a valve that has not changed, as a standard deviation, beside what strokes of one test differ by.

    Raises NegativeAnswer where strokes or common travel are too few.
    """
    low, high = _common(travel(before), travel(after))
    pair = signature(before, low, high), signature(after, low, high)
    rows = [_figures(one) for one in pair]
    found = []
    for name, unit in (("friction", "N"), ("spring rate", "N/m"), ("force at mid travel", "N")):
        first, last = (_with_share(row[name], repeatability) for row in rows)
        found.append(_quantity(name, unit, first, last, LEVEL / 2 / len(rows[0])))
    places, unlike = _places(*pair, repeatability), _unlike(*pair)
    return ComparisonResult(
        "recordings", before.name, after.name, tuple(found), places, tuple(_notes(unlike, repeatability)),
        _pictures(before, after, pair), LEVEL, unlike is None, shared_tag(before.plant, after.plant),
    )  # fmt: skip


Figure = tuple[ComparedValue, float]
"""An estimate and the degrees of freedom of its standard deviation."""


def _common(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    low, high = max(one[0], other[0]), min(one[1], other[1])
    longer = max(one[1] - one[0], other[1] - other[0])
    if not high - low > SHARED * longer:
        raise NegativeAnswer(
            f"cannot tell what changed: the recordings have {max(1e3 * (high - low), 0.0):.3g} mm of "
            f"{1e3 * longer:.3g} mm travel in common; record the same test"
        )
    return low, high


def _figures(s: Signature) -> dict[str, Figure]:
    """Friction, spring rate and the force at mid travel."""
    found, covariance, freedom = line(s)
    std = np.sqrt(np.diag(covariance))
    names = ("force at mid travel", "spring rate", "friction")
    return {n: (ComparedValue(float(v), float(sd)), freedom) for n, v, sd in zip(names, found, std, strict=True)}


def _with_share(figure: Figure, share: float) -> Figure:
    """The figure with what differs from test to test in its standard deviation."""
    estimate, freedom = figure
    return ComparedValue(estimate.value, float(np.hypot(estimate.std, share * abs(estimate.value)))), freedom


def _quantity(name: str, unit: str, before: Figure, after: Figure, level: float) -> Difference:
    (first, m), (last, n) = before, after
    variance = first.std**2 + last.std**2
    freedom = variance**2 / max(first.std**4 / m + last.std**4 / n, 1e-300)
    reach = float(student.isf(level / 2, max(freedom, 1.0))) * float(np.sqrt(variance))
    difference = last.value - first.value
    return Difference(name, unit, first, last, difference - reach, difference + reach)


def _profile(s: Signature) -> tuple[Array, Array, Array]:
    """Friction in every bin (n_bins,), its standard deviation and the degrees of freedom."""
    up, down = (s.force[s.direction == way] for way in (1, -1))
    n = [np.isfinite(one).sum(axis=0) for one in (up, down)]
    means = [_mean(one) for one in (up, down)]
    squares = [np.nansum((one - mean) ** 2, axis=0) for one, mean in zip((up, down), means, strict=True)]
    freedom = np.asarray(n[0] + n[1] - 2, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        std = 0.5 * np.sqrt((squares[0] + squares[1]) / freedom * (1 / n[0] + 1 / n[1]))
    return 0.5 * (means[0] - means[1]), np.where(freedom >= 2, std, np.nan), freedom


def _mean(rows: Array) -> Array:
    count = np.isfinite(rows).sum(axis=0)
    return np.where(count > 0, np.nansum(rows, axis=0) / np.maximum(count, 1), np.nan)


def _places(before: Signature, after: Signature, share: float) -> tuple[tuple[float, float, float, float], ...]:
    """Stretches of the travel where friction changed: ends [m], friction before and after [N]."""
    (f0, s0, n0), (f1, s1, n1) = _profile(before), _profile(after)
    known = np.isfinite(s0) & np.isfinite(s1)
    changed = np.zeros(len(f0), bool)
    for i in np.flatnonzero(known):
        one, other = (
            _with_share((ComparedValue(float(f[i]), float(s[i])), float(n[i])), share)
            for f, s, n in ((f0, s0, n0), (f1, s1, n1))
        )
        changed[i] = _quantity("friction", "N", one, other, LEVEL / 2 / known.sum()).changed
    half, found = 0.5 * float(before.x[1] - before.x[0]), []
    for is_changed, run in itertools.groupby(range(len(f0)), key=lambda i: bool(changed[i])):
        bins = list(run)
        if is_changed:
            ends = float(before.x[bins[0]] - half), float(before.x[bins[-1]] + half)
            found.append((*ends, float(f0[bins].mean()), float(f1[bins].mean())))
    return tuple(found)


def _unlike(before: Signature, after: Signature) -> str | None:
    """In what two tests are not alike, in words; None where they are."""
    pairs = {
        "the stem's speed in motion": (before.speed, after.speed, "m/s"),
        "the share of time in motion": (before.moving, after.moving, ""),
    }
    for what, (one, other, unit) in pairs.items():
        if not 1 / UNLIKE < other / one < UNLIKE:
            return f"{what} is {one:.2g} before and {other:.2g} {unit}".rstrip() + " after"
    return None


def _notes(unlike: str | None, share: float) -> list[str]:
    notes = []
    if unlike is not None:
        notes.append(
            f"The tests are not alike: {unlike}. Force over speed and at rest differs by that alone; record both alike "
            "before you trust a change."
        )
    if not share:
        notes.append(
            "Judged by what strokes of one test differ by. Tests on different days differ by more; "
            "give that as the repeatability."
        )
    return notes


def _pictures(before: Experiment, after: Experiment, pair: Sequence[Signature]) -> tuple[ComparedPicture, ...]:
    loops = [
        [ComparedCurve(f"{e.name}", 1e3 * s.motion.x, s.u) for s in e.segments] for e in (before, after)
    ]  # fmt: skip
    profiles = []
    for one in pair:
        friction, std, freedom = _profile(one)
        reach = student.isf(0.05, np.maximum(freedom, 1.0)) * std
        known = np.isfinite(friction)
        profiles.append([ComparedCurve(one.name, 1e3 * one.x[known], friction[known], np.nan_to_num(reach[known]))])
    return (
        ComparedPicture("Force against position", "position [mm]", "force [N]", *loops),
        ComparedPicture("Friction along the travel, with 90 % intervals", "position [mm]", "friction [N]", *profiles),
    )
