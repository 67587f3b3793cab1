"""What the measurements pull at, beside a fitted model: which shape of a force, or which rhythm, they ask for most.

A pull is the derivative of a fit's cost by a force on the stem, sample by sample (`FirstLook.pull`). Summed over a
shape it is the score of that shape's strength (Rao): of first order, but right while the valve sticks as well, and
where what is missing is far below the noise of a regression.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter
from scipy.sparse import csr_array

from recordings import Array
from simulator.first_look import FirstLook, Trial

BLOCK = 0.5
"""Length [s] of the blocks that say how much scores scatter: a slip, and the rest behind it."""
OWN = 1e-6
"""Share of a score's scatter that the scores of the base do not have, below which it is nothing of its own."""
SHAPES, OTHER = 3, 0.1
"""Shapes that are asked for most, and the share of its score that one has left beside another from which it is another
one: close places and like widths say the same."""
FINER, AROUND, PEAKS = 4, 101, 3
"""Steps of a frequency in one period over a recording, steps about one that tell how strong pulls are without a rhythm,
and the strongest rhythms: noise has some, too."""


def most_pulled(looks: Sequence[FirstLook], base: Mapping[str, float], trials: Iterable[Trial]) -> list[Trial]:
    """The shapes for whose strengths the score is largest, each of which says something else, largest first: beside
    changes of the base, and by the scatter that noise alone has. None where no model was fitted.
    """
    if any(look.pull is None for look in looks):
        return []
    pulls, found = [_Pulls.of(look) for look in looks], list[Trial]()
    beside = _Scores.of(pulls, lambda look: [*look.by_base(base, presliding=False).values()])
    scored = [(trial, _Scores.of_trial(pulls, trial)) for trial in trials]
    left = [(trial, scores, scores.statistic(beside)) for trial, scores in scored]
    while left and len(found) < SHAPES:
        best, known, _ = max(left, key=lambda one: one[2])
        found.append(best)
        both = beside.with_(known)
        left = [one for one in left if one[1].statistic(both) > OTHER * one[2]]
    return found


class _Pulls(NamedTuple):
    """What pulls in a look. blocks : matrix that sums over blocks what noise alone pulls, for one draw of it after the
    other.
    """

    look: FirstLook
    pull: Array
    blocks: csr_array

    @classmethod
    def of(cls, look: FirstLook) -> _Pulls:
        """The pulls of a look at a fitted model."""
        assert look.pull is not None
        assert look.by_chance is not None
        n, draws = look.by_chance.shape
        first = np.flatnonzero(np.diff((look.t - look.t[0]) // BLOCK, prepend=-1))
        begins = np.append((n * np.arange(draws)[:, None] + first).ravel(), n * draws)
        noise, places = look.by_chance.T.ravel(), np.tile(np.arange(n), draws)
        return cls(look, look.pull, csr_array((noise, places, begins), shape=(draws * len(first), n)))


class _Scores(NamedTuple):
    """The scores of some forces. seen (m,) : by the measurements; by_chance (n, m) : by noise alone, in blocks."""

    seen: Array
    by_chance: Array

    @classmethod
    def of(cls, pulls: Sequence[_Pulls], forces: Callable[[FirstLook], Sequence[Array]]) -> _Scores:
        """The scores of some forces, each (n,) at the samples of a look."""
        made = [np.column_stack(forces(one.look)) for one in pulls]
        pairs = list(zip(pulls, made, strict=True))
        seen, by_chance = [one.pull @ m for one, m in pairs], [one.blocks @ m for one, m in pairs]
        return cls(np.sum(seen, axis=0), np.concatenate(by_chance))

    @classmethod
    def of_trial(cls, pulls: Sequence[_Pulls], trial: Trial) -> _Scores:
        """The scores of the strengths of a shape."""
        return cls.of(pulls, lambda look: [force(look) for force in trial[1].values()])

    def with_(self, other: _Scores) -> _Scores:
        """These scores and others."""
        return _Scores(np.r_[self.seen, other.seen], np.column_stack([self.by_chance, other.by_chance]))

    def statistic(self, beside: _Scores) -> float:
        """How large these scores are beside others, as squares over the scatter by chance; 0 where they say nothing of
        their own.
        """
        m, both = len(beside.seen), beside.with_(self)
        scale = np.linalg.norm(both.by_chance, axis=0)
        if not (scale[m:] > 0).all():
            return 0.0
        scale[scale == 0] = 1.0
        scaled, seen = both.by_chance / scale, both.seen / scale
        scatter = scaled.T @ scaled
        others = np.linalg.lstsq(scatter[:m, :m], scatter[:m, m:], rcond=1e-8)[0]
        left, score = scatter[m:, m:] - scatter[m:, :m] @ others, seen[m:] - others.T @ seen[:m]
        return float(score @ np.linalg.solve(left, score)) if np.linalg.eigvalsh(left)[0] > OWN else 0.0


def rhythms(places: Sequence[Array], pulls: Sequence[Array], lowest: float, highest: float) -> list[float]:
    """Frequencies, in periods per unit of place, at which pulls (n,) at some places (n,) are strongest beside those at
    frequencies nearby, the strongest first. places : times or positions, in recordings that share their phase.

    The pull at a rhythmic force is the score of its amplitude (Rao): its periodogram has a peak at the true frequency
    and lower ones beside it, wherever the valve moves. It is found to a quarter of a period over the longest recording.
    """
    span = max(float(place.max() - place.min()) for place in places)
    if highest * span < 1.0 or lowest > highest:
        return []
    bins = 2 << int(np.ceil(np.log2(2 * highest * span)))
    f = np.fft.rfftfreq(FINER * bins, span / bins)
    score = np.zeros(len(f), complex)
    for place, pull in zip(places, pulls, strict=True):
        first, total = float(place.min()), np.zeros(FINER * bins)
        np.add.at(total, ((place - first) * (bins / span)).astype(int), pull)
        score += np.fft.rfft(total) * np.exp(-2j * np.pi * f * first)
    power = np.abs(score) ** 2
    power /= np.maximum(median_filter(power, AROUND, mode="mirror"), 1e-30 + 1e-9 * power.max())
    asked = (f >= lowest) & (f <= highest)
    f, power = f[asked], power[asked]
    found = list[float]()
    for i in np.argsort(-power):
        if all(abs(f[i] - one) > 1 / span for one in found):
            found.append(float(f[i]))
        if len(found) == PEAKS:
            break
    return found
