"""A model under trial: some effects, their fit to the fitted recordings, and the models one step away from it."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates
from identification.estimators.estimate import UNIT_LOSS, Estimate, lean
from identification.estimators.fitted import Fit
from identification.estimators.noise_aware.linearised_model import by_chance, pull_at_force
from identification.estimators.noise_aware.resolution import resolved_by_nodes
from identification.estimators.noise_aware.search import UNEXPLAINED
from identification.tracing import settings
from identification.tracing.models.promise import may_reach, newton_step
from identification.tracing.models.replicates import replicate_of
from identification.tracing.models.trial_data import TrialData
from recordings import Array
from simulator import Kernel

REPLICATE_SEED = 0
"""Seed of the noise, so that a trace gives the same answer every time."""
DRAWS = 4
"""Draws of noise that say how much pulls scatter by chance: together some thousand blocks of half a second."""
MEMORY_STEP = 1e-3
"""Longest sub-step [s] while the memory of a new effect is run along a path: finer changes nothing."""


@dataclass(frozen=True)
class Model:
    """Effects with their estimate on the fitted grids. effects : ids in the order of the catalogue; fit : of which the
    estimate goes on, None where it came of others.
    """

    effects: tuple[str, ...]
    data: TrialData
    estimate: Estimate
    fit: Fit | None = None

    @property
    def kernel(self) -> Kernel:
        """The kernel of these effects."""
        return self.data.kernel(self.effects)

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the free parameters."""
        return self.data.coordinates(self.effects)

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by full name, SI units."""
        return self.coordinates.values(self.estimate.theta)

    @property
    def cost(self) -> float:
        """The cost of the estimate on the fitted grids."""
        return self.estimate.cost

    @property
    def residual_force(self) -> list[Array]:
        """What the model had to add to the force as recorded, per fitted grid (n,) [N]."""
        pairs = zip(self.estimate.paths, self.data.fitted, strict=True)
        return [path[:, -2] - grid.force.u for path, grid in pairs]

    @property
    def pulls(self) -> list[Array]:
        """How strongly the measurements pull at the force on the stem, and how strongly noise alone would, some times;
        per fitted grid (n, 1 + `DRAWS`) [1/N].
        """
        now, rng, m = self.with_path_steps(0).estimate, np.random.default_rng(DRAWS), self.values["mass.m"]
        if self.data.imposed:
            sigmas = [np.sqrt(line.variances[:, 0]) for line in now.linearised]
            seen = [line.innovations[:, 0] / line.variances[:, 0] for line in now.linearised]
            noise = [rng.standard_normal((len(sigma), DRAWS)) / sigma[:, None] for sigma in sigmas]
            return [np.column_stack(pair) for pair in zip(seen, noise, strict=True)]
        pairs = zip(now.linearised, self.data.fitted, strict=True)
        made = [((line, *(by_chance(line, rng) for _ in range(DRAWS))), grid.t) for line, grid in pairs]
        return [np.column_stack([pull_at_force(line, t, m) for line in lines]) for lines, t in made]

    @property
    def shows_the_swing(self) -> bool:
        """Whether it is of damped order and has found a swing that nodes between samples resolve, where it explains
        enough to say so: then the full order suits the recordings.
        """
        if self.data.damped is None or self.estimate.loss > UNEXPLAINED:
            return False
        return resolved_by_nodes(self.values, self.data.spacing)

    @property
    def clear_gain(self) -> float:
        """The gain over it that is beyond doubt, for recordings of such sampling."""
        resolved = resolved_by_nodes(self.values, self.data.spacing)
        return settings.CLEAR_GAIN if resolved else settings.CLEAR_GAIN_UNRESOLVED

    @functools.cached_property
    def first_guesses(self) -> dict[str, Sequence[Mapping[str, float]]]:
        """The first guesses of other effects, by id, once they are known (`guesses.py`)."""
        return {}

    @functools.cached_property
    def cost_at_rest(self) -> float:
        """The cost after as many steps of the paths as trials of other models take."""
        return self.with_path_steps(settings.PATH_STEPS).cost

    @functools.cached_property
    def held_out(self) -> Estimate | None:
        """The estimate on the held-out grids: the paths alone, at the fitted parameters. None without a solution."""
        held_out = replace(self.data, fitted=self.data.held_out).estimator(self.effects, judging=True)
        found = held_out.start(self.estimate.theta, settings.STEPS)
        for _ in range(settings.REPEATS - 1):
            further = None if found is None else held_out.along(found.theta, found.paths, settings.STEPS)
            if found is None or further is None or further.cost > found.cost - settings.MIN_GAIN / 2:
                break
            found = further
        return None if found is None else lean(found)

    @functools.cached_property
    def held_out_within_error(self) -> Estimate | None:
        """The estimate on the held-out grids with the parameters moved as far as their error after the fit allows: what
        that explains is no lack of the model. What the move is against the fit is part of the loss.
        """
        if self.held_out is None or self.data.imposed:
            return self.held_out
        learned = (self.estimate.theta, self.estimate.normal.matrix)
        work = replace(self.data, fitted=self.data.held_out).estimator(self.effects, learned=learned, judging=True)
        end = work.refit(self.held_out.theta, self.held_out.paths, settings.STEPS)
        if end is None:
            return self.held_out
        strain = work.coordinates.told(end.theta).cost / end.samples / UNIT_LOSS
        return min(self.held_out, lean(replace(end, loss=end.loss + strain)), key=lambda one: one.loss)

    @functools.cached_property
    def fitted_to_all(self) -> Model | None:
        """Where the motion is imposed: the same effects fitted on to the fitted and the held-out grids at once. None
        without a solution.
        """
        together = replace(self.data, fitted=(*self.data.fitted, *self.data.held_out)).estimator(self.effects)
        end = together.fit(self.estimate.theta, settings.STEPS)
        fitted = None if end is None else self.data.estimator(self.effects).start(end.theta)
        return None if fitted is None else Model(self.effects, self.data, lean(fitted))

    def error_may_explain(self, excess: float) -> bool:
        """Whether parameters moved within their error may lower the loss on the held-out grids by so much. In damped
        order other paths may do so as well.
        """
        if self.held_out is None or self.data.damped is not None:
            return self.held_out is not None
        known, fitted = self.held_out.normal, self.estimate.normal.matrix
        promise = newton_step(replace(known, matrix=known.matrix + fitted))[1]
        return settings.PROMISE_FACTOR * promise > excess * self.held_out.samples * UNIT_LOSS

    def on_replicates(self, *, held_out: bool) -> Iterator[tuple[Estimate, tuple[Grid, ...]]]:
        """The same parameters on recordings that they could have given, fitted or held out, with their grids: one after
        the other, for each takes seconds, and the first may say enough. Those without a solution are left out.
        """
        for number in range(settings.REPLICATES):
            key = number, held_out
            if key not in self._known_replicates:
                self._known_replicates[key] = self._on_replicate(*key)
            estimate, grids = self._known_replicates[key]
            if estimate is not None:
                yield estimate, grids

    @functools.cached_property
    def _known_replicates(self) -> dict[tuple[int, bool], tuple[Estimate | None, tuple[Grid, ...]]]:
        """What is known of the model on replicates, by their numbers and whether they were held out."""
        return {}

    def _on_replicate(self, number: int, held_out: bool) -> tuple[Estimate | None, tuple[Grid, ...]]:
        """The paths alone on a replicate, as on the recordings: its held-out or its fitted grids."""
        data = replicate_of(self, np.random.default_rng([REPLICATE_SEED, number]))
        if held_out:
            return replace(self, data=data).held_out, data.held_out
        end = data.estimator(self.effects, judging=True).start(self.estimate.theta, settings.STEPS)
        return None if end is None else lean(end), data.fitted

    def on_held_out(self) -> Model:
        """The same model with the held-out grids as the fitted ones, where it has a solution on them."""
        if self.held_out is None:
            return self
        return replace(self, data=replace(self.data, fitted=self.data.held_out), estimate=self.held_out)

    def on_chunks(self) -> Model:
        """The same model on chunks of its grids."""
        data, places = self.data.on_chunks()
        paths = [np.ascontiguousarray(self.estimate.paths[i][at]) for i, at in places]
        estimate = data.estimator(self.effects).along(self.estimate.theta, paths, 0)
        return self if estimate is None else Model(self.effects, data, lean(estimate))

    def with_path_steps(self, steps: int) -> Model:
        """The same parameters after further steps of the paths."""
        work = self.data.estimator(self.effects)
        estimate = work.along(self.estimate.theta, self.estimate.paths, steps)
        return self if estimate is None else Model(self.effects, self.data, estimate)

    def refitted(self, below: float = np.inf) -> Model:
        """The same effects after further steps, until two of them change little or none leads below a cost."""
        return self._refitted_along(self.data, self.estimate.paths, below) or self

    def _refitted_along(self, data: TrialData, paths: Sequence[Array], below: float) -> Model | None:
        """These parameters fitted on to other data from some paths, while that may lead below a cost. None where it
        diverges.
        """
        work = data.estimator(self.effects, worth=settings.CHANCE_GAIN)
        end = work.refit(self.estimate.theta, paths, settings.STEPS, lambda now: not may_reach(now, below))
        return None if end is None else Model(self.effects, data, lean(end))

    def refitted_to(self, data: TrialData, below: float = np.inf) -> Model | None:
        """These parameters fitted on to other data, on new paths, while that may lead below a cost. None where it
        diverges.
        """
        work = data.estimator(self.effects, worth=settings.CHANCE_GAIN)
        end = work.fit(self.estimate.theta, settings.STEPS, lambda now: not may_reach(now, below))
        return None if end is None else Model(self.effects, data, lean(end))

    def refitted_beside(self, other: Model, below: float = np.inf) -> Model | None:
        """These parameters fitted on to the recordings of a model that has fewer effects, while that may lead below a
        cost: on new paths and, in damped order, on those of that model as well, wherever they explain more. They have
        slips that new ones miss. None where it diverges.
        """
        p = other.data.coordinates(self.effects).p(self.estimate.theta)
        paths = None if other.data.damped is None else other._extended_paths(self.kernel, p)
        if paths is None:
            return self.refitted_to(other.data, below)
        return self._refitted_along(other.data, paths, below)

    def with_effect(self, effect: str, values: Mapping[str, float], steps: int = 0) -> Model | None:
        """This model and one more effect at some values of its parameters (by full name, the others at their defaults),
        on the paths of this model, with its memory run along them. None where that has no solution.

        steps : of the paths after that.
        """
        effects = self.data.in_order(*self.effects, effect)
        target = self.data.kernel(effects)
        p = target.vector(self.data.defaults(effect) | self.values | dict(values))
        paths = self._extended_paths(target, p)
        if paths is None:
            return None
        theta = self.data.coordinates(effects).theta(p)
        estimate = self.data.estimator(effects).along(theta, paths, steps)
        return None if estimate is None else Model(effects, self.data, lean(estimate))

    def _extended_paths(self, target: Kernel, p: Array) -> Sequence[Array] | None:
        """The paths of this model as those of another kernel, which has more effects. None without a solution."""
        if self.data.imposed:
            return self.estimate.paths
        pairs = zip(self.data.fitted, self.estimate.paths, strict=True)
        found = [_extended(self.kernel, target, *pair, p) for pair in pairs]
        paths = [path for path in found if path is not None]
        return paths if len(paths) == len(found) else None

    def without(self, effect: str, below: float = np.inf) -> Model | None:
        """The other effects of this model, refitted on its paths while they may come below a cost. None where that has
        no solution.
        """
        effects = tuple(e for e in self.effects if e != effect)
        target = self.data.kernel(effects)
        theta = self.data.coordinates(effects).theta_of(self.values)
        kept = [] if self.data.imposed else [self.kernel.states.index(name) for name in target.states]
        paths = [np.ascontiguousarray(path[:, kept]) for path in self.estimate.paths]
        found = self.data.estimator(effects).along(theta, paths, settings.PATH_STEPS)
        return None if found is None else Model(effects, self.data, lean(found)).refitted(below)

    def swapped(self, effect: str, other: str, values: Mapping[str, float], below: float) -> Model | None:
        """This model with another effect, at some starting values, in the place of one, fitted on new paths while that
        may lead below a cost. None where it diverges.
        """
        effects = self.data.in_order(*(e for e in self.effects if e != effect), other)
        work = self.data.estimator(effects, worth=settings.CHANCE_GAIN)
        known = self.data.defaults(other) | self.values | dict(values)
        start = work.coordinates.theta(work.kernel.vector(known))
        end = work.fit(start, settings.STEPS, lambda now: not may_reach(now, below))
        if end is None or not may_reach(end, below):
            return None if end is None else Model(effects, self.data, lean(end))
        return Model(effects, self.data, lean(end)).refitted(below)


def _extended(here: Kernel, target: Kernel, grid: Grid, path: Array, p: Array) -> Array | None:
    """A path of `here` as one of `target`: what `here` does not have runs along it. None without a solution."""
    wide = np.zeros((len(path), len(target.states)))
    wide[:, : len(target.states) - 2] = target.start(path[0, 0], path[0, 1], path[0, -2])
    shared = [target.states.index(name) for name in here.states]
    wide[:, shared] = path
    run = target.shoot(grid.t, grid.force.u, p, wide, h_max=MEMORY_STEP, carry="memory")
    wide[:, shared] = path
    return None if run.failed is not None or not np.isfinite(wide).all() else wide
