"""A second opinion on what is missing: pysindy chooses among the candidates' own forces.

The estimated motion is imposed on the base model, and the force that it does not account for is regressed on a library.
Its columns come from the effects' one definition: the derivative of the predicted force by a strength is the force that
a little of that effect would add, and the derivatives by the base parameters are what a better base fit could still
take over, so they are taken out first. pysindy then selects by forward orthogonal least squares (Chen, Billings, Luo,
International Journal of Control 50(5), 1989). No path is found anew, nothing is refitted and nothing held out: a quick
look by other means, reported beside the answer and never in its place.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from identification.data.grid import Grid
from identification.estimators.imposed_motion.grid import ImposedGrid
from identification.sparse_regression import WINDOW, weak
from identification.tracing.model import Model, coordinates, defaults, in_order
from identification.tracing.screen import Rhythms, rhythms_of, shapes, strengths
from recordings import Array
from simulator import CATALOGUE, Kernel, Site, kernel, shows_imposed

NOTHING = 0.05
"""Share of the force left below which the choice is none."""
TRAVELS = (1.0, 0.3)
"""Break-away distances that a window has to pass: the first at which there are enough windows, on chunks of the
recordings or else on all of them."""
APART, TINY, SAME = 1e-4, 1e-100, 0.999
"""Share of a force that the base's own do not have, and its size, from which it is offered; correlation of two forces
from which they are one."""
FEWEST = 100
"""Windows in which the valve slides, below which nothing is said."""


@dataclass(frozen=True)
class SecondOpinion:
    """effect : pysindy's first choice, or ``none``; share : of the force left that all terms of it explain."""

    effect: str
    share: float

    @property
    def sentence(self) -> str:
        """In words."""
        if self.effect == "none":
            return "Sparse regression of the force left by the base model finds none of the effects in it"
        return (
            f"Sparse regression of the force left by the base model chooses {self.effect}, which explains "
            f"{100 * self.share:.0f} % of it"
        )


def second_opinion(base: Model) -> SecondOpinion | None:
    """Pysindy's choice for a base model; None where the valve hardly slides, or the model has no solution along its
    own motion."""
    for travel, some in itertools.product(TRAVELS, (base.thinned(), base)):
        pairs = list(zip(some.data.fitted, some.estimate.paths, strict=True))
        left, own = _left(some, pairs, travel)
        if left is not None and len(left) >= FEWEST:
            break
    else:
        return None
    terms, rhythms = dict[str, Array](), rhythms_of(base)
    for effect in base.data.candidates:
        if effect in base.effects or not shows_imposed(CATALOGUE[effect]) or CATALOGUE[effect].site is not Site.FORCE:
            continue
        mine = np.column_stack([np.zeros((len(left), 0)), *_terms(some, effect, rhythms, pairs, own, travel)])
        if mine.shape[1]:
            terms[effect] = mine
    left = left - own @ np.linalg.lstsq(own, left, rcond=None)[0]
    best = [terms[effect][:, int(np.argmax(np.abs(terms[effect].T @ left)))] for effect in terms]
    chosen = _first(np.column_stack(best), left) if best else None
    if chosen is None:
        return SecondOpinion("none", 0.0)
    effect = list(terms)[chosen]
    error = left - terms[effect] @ np.linalg.lstsq(terms[effect], left, rcond=1e-6)[0]
    share = 1.0 - float(error @ error) / float(left @ left)
    return SecondOpinion(effect if share > NOTHING else "none", share)


Pairs = list[tuple[Grid, Array]]


def _left(model: Model, pairs: Pairs, travel: float) -> tuple[Array | None, Array]:
    """What the base leaves of the force, and the columns of its parameters, as means over windows."""
    target = kernel(model.effects, "motion")
    p = target.vector(model.values)
    left, own = list[Array](), list[Array]()
    for grid, path in pairs:
        found = _imposed(target, model, grid, path, p)
        if found is None:
            return None, np.empty((0, 0))
        predicted, by = found
        left.append(_weak(model, travel, grid, path, grid.force.u - predicted)[:, 0])
        own.append(_weak(model, travel, grid, path, by[:, : len(p)][:, coordinates(model.effects, model.data).free]))
    return np.concatenate(left), _unit(np.concatenate(own))


def _terms(model: Model, effect: str, rhythms: Rhythms, pairs: Pairs, own: Array, travel: float) -> Iterator[Array]:
    """The forces of a little of an effect, one column per shape and strength, apart from the base's own columns."""
    effects = in_order(*model.effects, effect)
    target = kernel(effects, "motion")
    at = [target.parameters.index(name) for name in strengths(effect)]
    for shape in shapes(model, effect, rhythms):
        p = target.vector(defaults(effect, model.data) | model.values | shape)
        parts = list[Array]()
        for grid, path in pairs:
            found = _imposed(target, model, grid, path, p)
            if found is None:
                break
            parts.append(_weak(model, travel, grid, path, found[1][:, at]))
        if len(parts) < len(pairs):
            continue
        table = np.concatenate(parts)
        size = np.linalg.norm(table, axis=0)
        table = table - own @ np.linalg.lstsq(own, table, rcond=None)[0]
        apart = np.linalg.norm(table, axis=0) > APART * size
        yield from _unit(table[:, apart]).T


def _imposed(target: Kernel, model: Model, grid: Grid, path: Array, p: Array) -> tuple[Array, Array] | None:
    """The force that a motion takes (n,), and its derivatives by parameters and first memory (n, n_columns)."""
    if isinstance(grid, ImposedGrid):
        driven = grid.driven
    else:
        driven = np.column_stack([path[:, 0], path[:, 1], np.gradient(path[:, 1], grid.t), path[:, -2]])
    start = target.start(driven[0, 0], 0.0, driven[0, 3])
    for i, state in enumerate(target.states):
        if not model.data.imposed and state in model.kernel.states:
            start[i] = path[0, model.kernel.states.index(state)]
    found = target.run(grid.t, driven, p, start, h_max=1e-3, sensitivities=True)
    if found.jacobian is None or found.failed is not None:
        return None
    return found.outputs[:, 0], found.jacobian[:, 0, :]


def _weak(model: Model, travel: float, grid: Grid, path: Array, values: Array) -> Array:
    """Means over windows in which the valve moves: at rest the bristle holds any force."""
    table, p = values.reshape(len(grid.t), -1), model.values
    slides = np.abs(path[:, 1]) * WINDOW > travel * p["lugre.fc"] / p["lugre.sigma0"]
    sure = np.isfinite(table).all(axis=1) & slides
    return weak(np.where(sure[:, None], table, 0.0), sure, float(np.median(np.diff(grid.t))))


def _unit(table: Array) -> Array:
    """The columns that are anything, with length 1."""
    size = np.linalg.norm(table, axis=0)
    return np.asarray(table[:, size > TINY] / size[size > TINY])


def _first(library: Array, left: Array) -> int | None:
    """The column that pysindy's forward selection takes first. It orthogonalises all of the library, so a column that
    is nearly another one before it is not offered.
    """
    import pysindy as ps

    offered = list[int]()
    for i in range(library.shape[1]):
        if not offered or np.abs(library[:, offered].T @ library[:, i]).max() < SAME:
            offered.append(i)
    optimizer = ps.FROLS(max_iter=1, normalize_columns=False)
    optimizer.fit(library[:, offered], (left / max(float(np.linalg.norm(left)), TINY))[:, None])
    chosen = np.flatnonzero(np.asarray(optimizer.coef_).ravel())
    return offered[int(chosen[0])] if len(chosen) else None
