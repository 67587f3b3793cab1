"""A second opinion on what is missing: pysindy chooses among the candidates' own forces.

The smoothed motion is imposed on the base model, and the force that it does not account for is regressed on a library.
Its columns come from the effects' one definition: the derivative of the predicted force by a strength is the force that
a little of that effect would add, and the derivatives by the base parameters are what a better base fit could still
take over, so they are taken out first. pysindy then selects by forward orthogonal least squares (Chen, Billings, Luo,
International Journal of Control 50(5), 1989). No path is found anew, nothing is refitted and nothing held out: a quick
look by other means, reported beside the answer and never in its place.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from identification.data.grid import Grid
from identification.estimators.imposed_motion.grid import first_state
from identification.sparse_regression.weak_form import WINDOW, weak
from identification.tracing import settings
from identification.tracing.models.guesses import EffectGuesses, known_guesses, shapes, strengths
from identification.tracing.models.model import MEMORY_STEP, Model
from recordings import Array
from simulator import Kernel, Site, kernel, shows_imposed

TINY = 1e-100
"""Length below which a column is zero."""
SLIDING_DISTANCES = (1.0, 0.3)
"""Break-away distances that the valve slides within a window: the first with enough windows."""
MIN_WINDOWS = 100
"""Windows in which the valve slides at least: of fewer, nothing is said."""
MIN_APART, SAME_FORCE, SINGULAR = 1e-4, 0.999, 1e-6
"""Share of a force that is not one of the base model's own, from which it is offered; correlation of two forces from
which only one is; relative singular value below which two forces of an effect are taken for one."""


@dataclass(frozen=True)
class SecondOpinion:
    """effect : pysindy's first choice, or ``none``; share : of the residual force that all terms of it explain."""

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


@dataclass(frozen=True)
class Windows:
    """The residual force of a model as means over windows in which the valve slides.

    model : whose grids and paths are used; distance : break-away distances that the valve slides in a window;
    residual (n,), own (n, m) : the residual force and the unit columns of the model's own parameters.
    """

    model: Model
    distance: float
    residual: Array
    own: Array

    def means(self, grid: Grid, path: Array, values: Array) -> Array:
        """Means of columns of one grid (n_samples, ...) over its windows."""
        return _means(self.model, self.distance, grid, path, values)


def second_opinion(base: Model) -> SecondOpinion | None:
    """Pysindy's choice for a base model; None where the valve hardly slides, or the model has no solution along its
    own motion."""
    for distance in SLIDING_DISTANCES:
        windows = _windows(base, distance)
        if windows is not None and len(windows.residual) >= MIN_WINDOWS:
            break
    else:
        return None
    found, effects, own = known_guesses(base), base.data.catalogue, windows.own
    terms = dict[str, Array]()
    for effect in base.data.candidates:
        if effect in base.effects or not shows_imposed(effects[effect]) or effects[effect].site is not Site.FORCE:
            continue
        columns = np.column_stack([np.zeros((len(own), 0)), *_terms(windows, effect, found[effect])])
        if columns.shape[1]:
            terms[effect] = columns
    residual = windows.residual - own @ np.linalg.lstsq(own, windows.residual, rcond=None)[0]
    best = [columns[:, int(np.argmax(np.abs(columns.T @ residual)))] for columns in terms.values()]
    chosen = _first_choice(np.column_stack(best), residual) if best else None
    if chosen is None:
        return SecondOpinion("none", 0.0)
    effect = list(terms)[chosen]
    weights = np.linalg.lstsq(terms[effect], residual, rcond=SINGULAR)[0]
    error = residual - terms[effect] @ weights
    share = 1.0 - float(error @ error) / float(residual @ residual)
    return SecondOpinion(effect if share > settings.SMALL_SHARE else "none", share)


def _windows(model: Model, distance: float) -> Windows | None:
    """The residual force of a model over windows; None where it has no solution along its motion."""
    target = kernel(model.effects, "motion", model.data.catalogue)
    p, free = target.vector(model.values), model.coordinates.free
    residual, own = list[Array](), list[Array]()
    for grid, path in zip(model.data.fitted, model.estimate.paths, strict=True):
        found = _imposed(target, model, grid, path, p)
        if found is None:
            return None
        predicted, by = found
        residual.append(_means(model, distance, grid, path, grid.force.u - predicted)[:, 0])
        own.append(_means(model, distance, grid, path, by[:, : len(p)][:, free]))
    return Windows(model, distance, np.concatenate(residual), _unit(np.concatenate(own)))


def _terms(windows: Windows, effect: str, found: EffectGuesses) -> Iterator[Array]:
    """The forces of a little of an effect, one column per shape and strength, apart from the base's own columns."""
    model, own = windows.model, windows.own
    data = model.data
    target = kernel(data.in_order(*model.effects, effect), "motion", data.catalogue)
    at = [target.parameters.index(name) for name in strengths(data, effect)]
    for shape in shapes(data, effect, found):
        p, parts = target.vector(data.defaults(effect) | model.values | shape), list[Array]()
        for grid, path in zip(data.fitted, model.estimate.paths, strict=True):
            run = _imposed(target, model, grid, path, p)
            if run is None:
                break
            parts.append(windows.means(grid, path, run[1][:, at]))
        if len(parts) < len(data.fitted):
            continue
        table = np.concatenate(parts)
        size = np.linalg.norm(table, axis=0)
        table = table - own @ np.linalg.lstsq(own, table, rcond=None)[0]
        apart = np.linalg.norm(table, axis=0) > MIN_APART * size
        yield from _unit(table[:, apart]).T


def _imposed(target: Kernel, model: Model, grid: Grid, path: Array, p: Array) -> tuple[Array, Array] | None:
    """The force that a motion takes (n,), and its derivatives by parameters and first memory (n, n_columns)."""
    driven = grid.driven_along(path)
    start = first_state(target, driven)
    for i, state in enumerate(target.states):
        if not model.data.imposed and state in model.kernel.states:
            start[i] = path[0, model.kernel.states.index(state)]
    found = target.run(grid.t, driven, p, start, h_max=MEMORY_STEP, sensitivities=True)
    if found.jacobian is None or found.failed is not None:
        return None
    return found.outputs[:, 0], found.jacobian[:, 0, :]


def _means(model: Model, distance: float, grid: Grid, path: Array, values: Array) -> Array:
    """Means over windows in which the valve moves: at rest the bristle holds any force."""
    table, p = values.reshape(len(grid.t), -1), model.values
    slides = np.abs(path[:, 1]) * WINDOW > distance * p["lugre.fc"] / p["lugre.sigma0"]
    sure = np.isfinite(table).all(axis=1) & slides
    return weak(np.where(sure[:, None], table, 0.0), sure, float(np.median(np.diff(grid.t))))


def _unit(table: Array) -> Array:
    """The columns that are anything, with length 1."""
    size = np.linalg.norm(table, axis=0)
    return np.asarray(table[:, size > TINY] / size[size > TINY])


def _first_choice(library: Array, residual: Array) -> int | None:
    """The column that pysindy's forward selection takes first. It orthogonalises all of the library, so a column that
    is nearly another one before it is not offered.
    """
    import pysindy as ps

    offered = list[int]()
    for i in range(library.shape[1]):
        if not offered or np.abs(library[:, offered].T @ library[:, i]).max() < SAME_FORCE:
            offered.append(i)
    optimizer = ps.FROLS(max_iter=1, normalize_columns=False)
    optimizer.fit(library[:, offered], (residual / max(float(np.linalg.norm(residual)), TINY))[:, None])
    chosen = np.flatnonzero(np.asarray(optimizer.coef_).ravel())
    return offered[int(chosen[0])] if len(chosen) else None
