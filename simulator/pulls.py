"""What the measurements pull at, beside a fitted model: which shape of a force, or which rhythm, they ask for most.

A pull is the derivative of a fit's cost by a force on the stem, sample by sample (`FirstLook.pull`). Summed over a
shape it is the score of that shape's strength (Rao): of first order, but right while the valve sticks as well, and
where what is missing is far below the noise of a regression.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from scipy.ndimage import median_filter

from recordings import Array
from simulator.first_look import FirstLook, Trial

BLOCK = 0.5
"""Length [s] of the blocks that say how much scores scatter: a slip, and the rest behind it."""
OWN = 1e-6
"""Share of a score's scatter that the scores of the base do not have, below which it is nothing of its own."""
FINER, AROUND, PEAKS = 4, 101, 3
"""Steps of a frequency in one period over a recording, steps about one that tell how strong pulls are without a rhythm,
and the strongest rhythms: noise has some, too."""


def most_pulled(looks: Sequence[FirstLook], base: Mapping[str, float], trials: Iterable[Trial]) -> list[Trial]:
    """The shape for whose strengths the score is largest, beside changes of the base and by its scatter over blocks;
    none where no model was fitted.
    """
    if any(look.pull is None for look in looks):
        return []
    beside = [_scores(look, [*look.by_base(base, presliding=False).values()]) for look in looks]
    known = np.vstack(beside)

    def statistic(trial: Trial) -> float:
        return _statistic(known, np.vstack([_scores(look, [f(look) for f in trial[1].values()]) for look in looks]))

    return sorted(trials, key=statistic)[-1:]


def _scores(look: FirstLook, forces: Sequence[Array]) -> Array:
    """The scores of some forces (n,) in every block, (n_blocks, n_forces)."""
    assert look.pull is not None
    block = ((look.t - look.t[0]) // BLOCK).astype(int)
    return np.column_stack([np.bincount(block, look.pull * force) for force in forces])


def _statistic(known: Array, own: Array) -> float:
    """The score test of strengths by their scores in blocks, own (n_blocks, k), beside those of the base (n_blocks, m);
    their scatter is that of the blocks.
    """
    scores = np.column_stack([known, own])
    scale = np.linalg.norm(scores, axis=0)
    if not (scale[known.shape[1] :] > 0).all():
        return 0.0
    scores = scores / np.where(scale > 0, scale, 1.0)
    scatter, m = scores.T @ scores, known.shape[1]
    beside = np.linalg.lstsq(scatter[:m, :m], scatter[:m, m:], rcond=1e-8)[0]
    left = scatter[m:, m:] - scatter[m:, :m] @ beside
    total = scores.sum(axis=0)
    score = total[m:] - beside.T @ total[:m]
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
