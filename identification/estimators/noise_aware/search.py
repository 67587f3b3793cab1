"""The search of a noise-aware fit: many starts on chunks of the recordings, the best of their ends on all.

A start that is far off in mass, bristle stiffness or damping leads to a path from which no step helps. So starts are
compared by the cost of the smoothed path alone, descents from the better ones are made on some seconds of each
recording with different freedom of the path, and only the best end is carried to whole recordings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from identification.budget import time_is_over
from identification.data.chunks import centred
from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import HOPELESS, Estimate, converged, lean
from identification.estimators.noise_aware.estimator import NoiseAware, Stages
from identification.estimators.noise_aware.linearised_model import PathFreedom
from recordings import Array, Progress, silent

CHUNK, CHUNK_S, CHUNKS = 2500, 4.0, 6
"""Least nodes and seconds of a chunk, and number of chunks of all recordings together, about."""
SCREEN = PathFreedom(1.0, 1e-4, 0.1, 1e-3)
"""Freedom at which starts are compared: with more of it a wrong mass cannot be told from the right one."""
CHANGES, ROUNDS = 10, 2
"""Number of changes of the best start, and times that they are tried."""
DIRECT: Stages = ((PathFreedom(1.0, 1e-3, 0.3, 1e-3), 5), (PathFreedom(1.0, 1e-4, 0.1, 1e-3), 9))
GENTLE: Stages = (
    (PathFreedom(3.0, 3e-3, 0.3, 1e-3, honest=False), 6),
    (PathFreedom(1.0, 1e-3, 0.3, 1e-3, honest=False), 6),
    (PathFreedom(1.0, 1e-4, 0.1, 1e-3), 8),
)
WIDE: Stages = (
    (PathFreedom(3.0, 1e-2, 0.3, 1e-3, honest=False), 6),
    (PathFreedom(2.0, 3e-3, 0.3, 1e-3, honest=False), 6),
    *DIRECT,
)
"""Stages of a descent from a start on chunks, by how much freedom the path has at first."""
RIGHT = 1.06
"""Mean loss on chunks up to which an end is taken to be the right one at once: wrong ends have 1.1 to 15."""
UNEXPLAINED, NOT_FAR = 3.0, 2.0
"""Mean loss from which the model is known to lack much, and how many times the least loss is not far behind it."""
TELLING = 5000
"""Positions on chunks from which the loss tells a right end from a wrong one, so that a start may be tried unseen."""
MOST_TRIES = 7
"""Descents on chunks at most before the best end is carried to whole recordings."""
AGREED = 2.0
"""Difference of the costs of two ends on chunks up to which they are the same."""
HOPELESS_TRIES = 3
"""Descents after which no more are made where all ends follow nothing of the data (`HOPELESS`)."""
RISING = 0.8
"""Slope at which a rising friction curve goes from fs to fc, in (fc - fs)/vs."""
MASSES = (0.2, 30.0)
"""Moving masses [kg] that are tried."""


def on_chunks(whole: NoiseAware) -> NoiseAware:
    """The same fit to chunks of its grids."""
    return replace(whole, grids=chunks(whole.grids))


def best_on_chunks(
    small: NoiseAware, starts: Sequence[Array], *, most: int = MOST_TRIES, progress: Progress = silent
) -> Estimate | None:
    """The best end on chunks, of at most so many descents, from starting values (m,), best first. None where the model
    diverges from all. It may be the wrong one: ask `converged`.
    """
    ends: list[Estimate] = []
    for tries, (start, stages) in enumerate(_descents(small, starts), 1):
        progress("search on chunks", tries - 1, most)
        end = small.in_stages(start, stages)
        end = None if end is None else small.strict(end)
        if end is not None:
            ends.append(lean(end))
        hopeless = tries >= HOPELESS_TRIES and all(end.loss > HOPELESS for end in ends)
        if ends and (tries >= most or hopeless or ends[-1].loss < RIGHT or _agreed(ends) or time_is_over()):
            break
    return _best(small, ends, starts[-1]) if ends else None


def _agreed(ends: Sequence[Estimate]) -> bool:
    """Whether two descents, and none to a better end, led to the same place."""
    least = min(end.cost for end in ends)
    return sum(end.cost < least + AGREED for end in ends) > 1


def _best(problem: NoiseAware, ends: Sequence[Estimate], start: Array) -> Estimate:
    """The end with the least cost; where the model explains nothing well, of those not far behind the one whose mass is
    nearest to that of a start: likelihood would then choose what bends the model most, a mass of tons for example.
    """
    least = min(end.loss for end in ends)
    if least < UNEXPLAINED or "mass.m" not in problem.names:
        return min(ends, key=lambda end: end.cost)
    mass = problem.names.index("mass.m")
    return min((e for e in ends if e.loss < NOT_FAR * least), key=lambda end: abs(end.theta[mass] - start[mass]))


def on_whole_recordings(whole: NoiseAware, small: NoiseAware, best: Estimate) -> Estimate | None:
    """The fit to whole recordings from the best end on chunks; where it fails, once more from there.

    best.theta (m,) : the start, in the coordinates of the problem. None where the model diverges.
    """
    found: Estimate | None = None
    theta = best.theta
    for _ in range(2):
        end = whole.in_stages(theta)
        end = None if end is None else whole.strict(end)
        if end is not None:
            found = end if found is None else _best(whole, (found, end), best.theta)
        if found is None or converged(found) or found.loss > HOPELESS or time_is_over():
            break
        again = [small.in_stages(found.theta, DIRECT)]
        again += [small.in_stages(start, GENTLE) for start in usual_values(small.coordinates, found.theta)[:1]]
        ends = [end for end in again if end is not None]
        theta = (_best(small, ends, best.theta) if ends else found).theta
    return found


def _descents(problem: NoiseAware, starts: Sequence[Array]) -> Iterator[tuple[Array, Stages]]:
    """Starts and stages of the descents worth making, the likeliest first."""
    if problem.positions > TELLING:
        yield starts[0], DIRECT
    ranked = screened(problem, starts)
    first = ranked[0]
    yield first, DIRECT
    yield first, WIDE
    for start in usual_values(problem.coordinates, starts[0]):
        yield start, GENTLE
    for start in usual_values(problem.coordinates, starts[-1]):
        yield start, WIDE
    for start in ranked[1:]:
        yield start, GENTLE


def chunks(grids: Sequence[Grid], nodes: int = CHUNK, seconds: float = CHUNK_S) -> list[Grid]:
    """Some stretches of every grid (n_samples,), evenly spread, when grids are long; nodes, seconds [s] : in a stretch,
    at least.
    """
    return [grids[i].part(at.start, at.stop) for i, at in chunk_places(grids, nodes, seconds)]


def chunk_places(
    grids: Sequence[Grid], nodes: int = CHUNK, seconds: float = CHUNK_S
) -> list[tuple[int, slice]]:  # fmt: skip
    """Where those stretches are: the number of the grid of each, and its nodes."""
    total, found = sum(len(s.t) for s in grids), list[tuple[int, slice]]()
    for i, s in enumerate(grids):
        n, count = len(s.t), max(1, round(CHUNKS * len(s.t) / total))
        length = max(nodes, int(seconds * (n - 1) / (s.t[-1] - s.t[0])))
        short = 1.5 * length * count >= n
        found += [(i, at) for at in ([slice(0, n)] if short else centred(n, length, count))]
    return found


def screened(problem: NoiseAware, starts: Sequence[Array]) -> list[Array]:
    """Starts and changes of the best of them, best first, by the cost after a few steps of the path alone.

    starts : (m,) each, in the coordinates of the problem, as the answers.
    """
    screening, tried = problem.with_freedom(SCREEN), list[tuple[float, Array]]()

    def cost_of(candidate: Array) -> float:
        estimate = screening.start(candidate)
        tried.append((np.inf if estimate is None else estimate.cost, candidate))
        return tried[-1][0]

    for start in starts:
        for candidate in (start, *usual_values(problem.coordinates, start)):
            cost_of(candidate)
    cost, best = min(tried, key=lambda pair: pair[0])
    for _ in range(ROUNDS):
        if time_is_over():
            break
        before = cost
        for change in range(CHANGES):
            candidate = _changed(problem, best, change)
            value = cost_of(candidate)
            if value < cost - 10.0:
                best, cost = candidate, value
        if before - cost < 0.01 * sum(len(s.t) for s in problem.grids):
            break
    return [candidate for _, candidate in sorted(tried, key=lambda pair: pair[0])]


def usual_values(coordinates: Coordinates, theta: Array) -> list[Array]:
    """A start with what noise makes extreme set to usual values: friction curve, damping of the bristle, and mass. A
    curve that rises with speed, fs below fc, is viscous friction in disguise.

    theta (m,) : the start, in the given coordinates, as the answers.
    """
    value = coordinates.values(theta)
    rise = value["lugre.fc"] - value["lugre.fs"]
    if rise > 0:
        viscous = value["lugre.sigma2"] + RISING * rise / value["lugre.vs"]
        value = value | {"lugre.fc": value["lugre.fs"], "lugre.sigma2": viscous}
    fc, critical = value["lugre.fc"], 2 * np.sqrt(value["lugre.sigma0"])
    curve = {"lugre.fs": float(np.clip(value["lugre.fs"], 1.1 * fc, 1.5 * fc)),
             "lugre.vs": float(np.clip(value["lugre.vs"], 1.5e-3, 1e-2))}  # fmt: skip
    masses = dict.fromkeys((3.0, value["mass.m"]))
    return [
        coordinates.theta_of(value | curve | {"mass.m": m, "lugre.sigma1": 0.3 * critical * np.sqrt(m)}) for m in masses
    ]


def _changed(problem: NoiseAware, theta: Array, change: int) -> Array:
    """A start with another friction curve, bristle or mass; change : which, below `CHANGES`."""
    value = problem.coordinates.values(theta)
    fc, s0, s1, m = (value[n] for n in ("lugre.fc", "lugre.sigma0", "lugre.sigma1", "mass.m"))
    others = [{"lugre.sigma0": f * s0, "lugre.sigma1": f**0.5 * s1} for f in (0.05, 0.2, 5.0)]
    others += [{"lugre.sigma1": f * s1} for f in (0.2, 4.0)]
    others += [{"mass.m": float(np.clip(f * m, *MASSES))} for f in (0.3, 3.0)]
    others += [{"lugre.fs": 1.3 * fc, "lugre.vs": vs} for vs in (1e-3, 3e-3, 8e-3)]
    return problem.coordinates.theta_of(value | others[change])
