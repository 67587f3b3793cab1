"""The search of a noise-aware fit: from starting values to chunks of the recordings, and from there to all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.data.chunks import centred
from identification.data.grid import Grid
from identification.estimators.estimate import HOPELESS, Estimate, converged, lean
from identification.estimators.noise_aware.estimator import NoiseAware
from recordings import Array, Progress, silent

CHUNK, CHUNK_S, CHUNKS = 1000, 4.0, 6
"""Least nodes and seconds of a chunk, and number of chunks of all recordings together, about."""
STEPS, ROUNDS = 6, 6
"""Steps of a descent before it goes on along new paths, and times that it does at most."""
NOTABLE = 30.0
"""Fall of the cost from which going on is worth its time."""
RIGHT = 1.06
"""Mean loss on chunks up to which an end is taken to be the right one at once: wrong ends have 1.1 to 15."""
UNEXPLAINED = 3.0
"""Mean loss from which the model is known to lack much."""


def best_on_chunks(whole: NoiseAware, starts: Sequence[Array], progress: Progress = silent) -> Estimate | None:
    """The best end on chunks from starting values (m,), the likeliest first. None where the model diverges from all. It
    may be the wrong one: ask `converged`.
    """
    small, ends = replace(whole, grids=chunks(whole.grids)), list[Estimate]()
    for done, start in enumerate(starts):
        progress("search on chunks", done, len(starts))
        end = on_new_paths(small, start)
        ends += [] if end is None else [end]
        if end is not None and end.loss < RIGHT:
            break
    return min(ends, key=lambda end: end.cost) if ends else None


def on_new_paths(work: NoiseAware, theta: Array, rounds: int = ROUNDS) -> Estimate | None:
    """The end of descents from theta (m,), each along new paths, as long as that helps. None where the model diverges.

    The smoother holds on to slips that a path has, and to rests; the model at better parameters has others.
    """
    best: Estimate | None = None
    for _ in range(rounds):
        end = work.fit(theta, STEPS)
        if end is None:
            break
        fall = float("inf") if best is None else best.cost - end.cost
        best = lean(end) if fall > 0 or best is None else best
        if fall < NOTABLE or end.loss > HOPELESS:
            break
        theta = end.theta
    return best


def on_whole_recordings(whole: NoiseAware, best: Estimate) -> Estimate | None:
    """The fit to whole recordings from the best end on chunks; where it fails, once more from there.

    None where the model diverges.
    """
    found, theta = None, best.theta
    for _ in range(2):
        end = whole.in_stages(theta)
        end = None if end is None else whole.strict(end)
        if end is not None and (found is None or end.cost < found.cost):
            found = end
        if found is None or converged(found, resolved=not whole.kernel.damped) or found.loss > HOPELESS:
            break
        theta = found.theta
    return found


def chunks(grids: Sequence[Grid]) -> list[Grid]:
    """Some stretches of every grid (n_samples,), evenly spread, when grids are long."""
    total, found = sum(len(s.t) for s in grids), []
    for s in grids:
        n, count = len(s.t), max(1, round(CHUNKS * len(s.t) / total))
        length = max(CHUNK, int(CHUNK_S * (n - 1) / (s.t[-1] - s.t[0])))
        short = 1.5 * length * count >= n
        found += [s] if short else [s.part(c.start, c.stop) for c in centred(n, length, count)]
    return found
