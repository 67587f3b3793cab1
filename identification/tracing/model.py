"""A model under trial while tracing: some effects, their fit to the fitted recordings, and its judgement on others."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.data.chunks import regular
from identification.data.experiment import Experiment
from identification.data.grid import Grid
from identification.estimators.coordinates import Coordinates, parameters
from identification.estimators.estimate import Estimate, lean
from identification.estimators.imposed_motion.estimator import ImposedMotion
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.estimators.noise_aware.linearised_model import PathFreedom
from identification.estimators.noise_aware.resolution import resolving
from identification.estimators.noise_aware.search import usual_values
from identification.estimators.path_estimator import PathEstimator
from recordings import Array
from simulator import CATALOGUE, Kernel, kernel

FINAL = PathFreedom(1.0, 1e-5, 0.1, 5e-4, honest=False)
"""PathFreedom of all fits while tracing: they start near their end."""
COARSE = replace(FINAL, h_max=2e-3)
"""The same of searches on chunks."""
REFIT = 12
"""Steps of a refit."""
IDLE = 2.0
"""Fall of the cost below which two steps of a search or a refit are its last."""
SEARCH, LOOK, FOLLOWED = 12, 4, 2
"""Steps of a search on chunks, those after which its starts are compared, and how many of them go on."""
SAME_END = 0.05
"""Relative difference of all parameters of an effect up to which two ends are one."""
HELD_STEPS, HELD_ROUNDS, HELD_FALL = 10, 5, 30.0
"""Steps of the paths on held-out recordings, times that they are taken at most, and fall of the cost by so many below
which paths have come to rest: those of plays take long."""
RESTED = 2
"""Steps of the paths after which the costs of a model and of a trial of another are compared."""


@dataclass(frozen=True)
class TrialData:
    """What all models are tried on: grids to fit and grids held out, constants that are held, the travel (lowest,
    highest position seen) [m], the stiffest bristle [N/m], for one that no node resolves explains what it likes, and
    the heaviest mass [kg], which does, too; imposed : the motion is, and the force is predicted; candidates : effects
    that can show in what is predicted; recorded : the experiments of the grids, fitted and held out.
    """

    fitted: tuple[Grid, ...]
    held: tuple[Grid, ...]
    given: Mapping[str, float]
    travel: tuple[float, float]
    force_std: float
    stiffest: float = float("inf")
    heaviest: float = float("inf")
    imposed: bool = False
    candidates: tuple[str, ...] = CATALOGUE.ids
    recorded: tuple[tuple[Experiment, ...], tuple[Experiment, ...]] = ((), ())

    def kernel(self, effects: tuple[str, ...]) -> Kernel:
        """The kernel of some effects."""
        return kernel(effects, "motion" if self.imposed else "uncertain force")

    def thinned(self) -> tuple[TrialData, list[tuple[int, slice]]]:
        """A data of chunks of the fitted grids, with where each comes from: enough for a first look."""
        if self.imposed:  # memory would have to be found anew in every chunk, and the whole costs little
            return self, [(i, slice(0, len(grid.t))) for i, grid in enumerate(self.fitted)]
        places = [(i, at) for i, grid in enumerate(self.fitted) for at in _chunks(grid)]
        return replace(self, fitted=tuple(self.fitted[i].part(at.start, at.stop) for i, at in places)), places

    def resolving(self, omega: float) -> TrialData:
        """The same with nodes close enough for a swing of omega [rad/s], within reason."""
        return replace(self, fitted=tuple(resolving(self.fitted, omega)), held=tuple(resolving(self.held, omega)))

    @property
    def samples(self) -> int:
        """Number of nodes of the fitted grids."""
        return sum(len(grid.t) for grid in self.fitted)

    @property
    def in_chunks(self) -> float:
        """Share of those nodes that lies in the chunks of a first look."""
        return self.thinned()[0].samples / self.samples

    @property
    def stroke(self) -> float:
        """Length of the travel [m]."""
        return self.travel[1] - self.travel[0]


@dataclass(frozen=True)
class Model:
    """Effects with their estimate on the fitted grids."""

    effects: tuple[str, ...]
    data: TrialData
    estimate: Estimate

    @property
    def kernel(self) -> Kernel:
        """The kernel of these effects."""
        return self.data.kernel(self.effects)

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the free parameters."""
        return coordinates(self.effects, self.data)

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by full name, SI units."""
        return self.coordinates.values(self.estimate.theta)

    @property
    def force_left(self) -> list[Array]:
        """What the model had to add to the force as recorded, per fitted grid (n,) [N]."""
        pairs = zip(self.estimate.paths, self.data.fitted, strict=True)
        return [path[:, -2] - grid.force.u for path, grid in pairs]

    @functools.cached_property
    def rested_cost(self) -> float:
        """The cost after `RESTED` steps of the paths."""
        return self.relaxed(RESTED).estimate.cost

    @functools.cached_property
    def held(self) -> Estimate | None:
        """The paths on the held-out grids at the fitted parameters."""
        judge = problem(self.effects, self.data, self.data.held)
        if not isinstance(judge, NoiseAware):
            only = judge.start(self.estimate.theta)
            return None if only is None else lean(only)
        found = judge.start(self.estimate.theta, HELD_STEPS)
        for _ in range(HELD_ROUNDS - 1):
            if found is None:
                break
            before, found = found, judge.along(found.theta, found.paths, HELD_STEPS) or found
            if found.cost > before.cost - HELD_FALL:
                break
        return None if found is None else lean(found)

    def at_held(self) -> Model:
        """The same model looked at on the grids that are held out, where it has a solution on them."""
        if self.held is None:
            return self
        return replace(self, data=replace(self.data, fitted=self.data.held), estimate=self.held)

    def thinned(self) -> Model:
        """The same model on chunks of its grids."""
        data, places = self.data.thinned()
        paths = [np.ascontiguousarray(self.estimate.paths[i][at]) for i, at in places]
        estimate = along(problem(self.effects, data, data.fitted), self.estimate.theta, paths, 0)
        return self if estimate is None else Model(self.effects, data, estimate)

    def relaxed(self, steps: int) -> Model:
        """The same parameters after further steps of the paths."""
        work = problem(self.effects, self.data, self.data.fitted)
        estimate = along(work, self.estimate.theta, self.estimate.paths, steps)
        return self if estimate is None else Model(self.effects, self.data, estimate)

    def refitted(self) -> Model:
        """The same effects after further steps."""
        return self.descended(FINAL, REFIT)

    def descended(self, freedom: PathFreedom, steps: int) -> Model:
        """The same effects after so many further steps, or until two of them change little."""
        work = problem(self.effects, self.data, self.data.fitted, freedom, IDLE)
        first = along(work, self.estimate.theta, self.estimate.paths, 0)
        return self if first is None else replace(self, estimate=lean(work.descend(first, steps)))

    def sought(self) -> Model | None:
        """The best fit of these effects to chunks of the grids; None where all diverge."""
        return next(iter(followed(self.looks())), None)

    def looks(
        self, *effect: str, values: Mapping[str, float] | None = None, from_here: bool = True
    ) -> list[Model]:  # fmt: skip
        """First fits to chunks of the grids of this model, or of it and one more effect at some values, best first:
        from here, unless not wanted, with the mass, the damping and the friction curve set back to usual ones, and
        from where the effect says that a model without it may have bent. Empty where all diverge.

        A base model bends its parameters to make up for what it lacks, and from there the way back can be barred.
        """
        effects = in_order(*self.effects, *effect)
        data, _ = self.data.thinned()
        work = problem(effects, data, data.fitted, COARSE)
        known = {k: v for e in effect for k, v in defaults(e, self.data).items()} | self.values | dict(values or {})
        theta = work.coordinates.theta(work.kernel.vector(known))
        starts = [theta] * from_here + usual_values(work.coordinates, theta)[:1]
        bent = [work.kernel.vector(known | dict(start)) for e in effect for start in self.imitations(e)]
        own = _looks(work, starts)
        imitated = _looks(work, [work.coordinates.theta(p) for p in bent])
        best = sorted([*own, *imitated], key=lambda look: look.cost)[:FOLLOWED]
        if imitated and all(look is not imitated[0] for look in best):  # plays and hysteresis come to rest slowly
            best.append(imitated[0])
        return [Model(effects, data, look) for look in best]

    def imitations(self, effect: str) -> list[Mapping[str, float]]:
        """Values by which this model may imitate an effect, from which to seek it."""
        if self.data.imposed:
            return []
        return list(CATALOGUE[effect].imitated(self.values))

    def without(self, effect: str) -> Model | None:
        """The other effects of this model, fitted on from here."""
        effects = tuple(e for e in self.effects if e != effect)
        target = self.data.kernel(effects)
        theta = coordinates(effects, self.data).theta_of(self.values)
        kept = [] if self.data.imposed else [self.kernel.states.index(name) for name in target.states]
        paths = [np.ascontiguousarray(path[:, kept]) for path in self.estimate.paths]
        first = along(problem(effects, self.data, self.data.fitted), theta, paths, RESTED)
        return None if first is None else Model(effects, self.data, first).refitted()

    def exchanged(self, effect: str, other: str, values: Mapping[str, float]) -> Model | None:
        """This model with another effect, at some values to start from, in the place of one. None where it diverges."""
        effects = in_order(*(e for e in self.effects if e != effect), other)
        work = problem(effects, self.data, self.data.fitted, worth=IDLE)
        known = defaults(other, self.data) | self.values | dict(values)
        end = work.fit(work.coordinates.theta(work.kernel.vector(known)), REFIT)
        return None if end is None else Model(effects, self.data, lean(end)).refitted()

    def carried(self, data: TrialData) -> Model | None:
        """These parameters fitted on to all of a data, along new paths."""
        end = problem(self.effects, data, data.fitted, worth=IDLE).fit(self.estimate.theta, REFIT)
        return None if end is None else Model(self.effects, data, lean(end))

    def with_effect(self, effect: str, values: Mapping[str, float], steps: int = 0) -> Model | None:
        """This model and one more effect at some values of its parameters (by full name, the others at their defaults),
        its memory run along the paths. None where that has no solution.
        """
        effects = in_order(*self.effects, effect)
        target, here = self.data.kernel(effects), self.kernel
        p = target.vector(defaults(effect, self.data) | self.values | dict(values))
        pairs = zip(self.data.fitted, self.estimate.paths, strict=True)
        found = self.estimate.paths if self.data.imposed else [extended(here, target, *pair, p) for pair in pairs]
        paths = [path for path in found if path is not None]
        if len(paths) < len(found):
            return None
        theta = coordinates(effects, self.data).theta(p)
        estimate = along(problem(effects, self.data, self.data.fitted), theta, paths, steps)
        return None if estimate is None else Model(effects, self.data, estimate)


def _looks(work: PathEstimator, starts: Sequence[Array]) -> list[Estimate]:
    """First fits from some starts, best first."""
    looks = [work.fit(start, LOOK) for start in starts]
    return sorted((lean(look) for look in looks if look is not None), key=lambda look: look.cost)


def followed(looks: Sequence[Model]) -> list[Model]:
    """Some first fits to chunks followed on, best first."""
    return sorted((look.descended(COARSE, SEARCH - LOOK) for look in looks), key=lambda end: end.estimate.cost)


def apart(effect: str, one: Model, other: Model) -> bool:
    """Whether two ends are two, by the parameters of an effect."""
    names = CATALOGUE[effect].parameter_names()
    a, b = (np.array([model.values[name] for name in names]) for model in (one, other))
    return bool((np.abs(a - b) > SAME_END * np.maximum(np.abs(a), np.abs(b))).any())


CHUNK, EVERY = 2.0, 7.0
"""Length and distance of the chunks of a thinned grid [s]."""


def _chunks(grid: Grid) -> list[slice]:
    """Chunks spread over a grid; all of a short one."""
    dt = (grid.t[-1] - grid.t[0]) / (len(grid.t) - 1)
    length, distance = round(CHUNK / dt), round(EVERY / dt)
    if len(grid.t) < 2 * distance or length < 20:
        return [slice(0, len(grid.t))]
    return regular(len(grid.t), length, distance)


def in_order(*effects: str) -> tuple[str, ...]:
    """Effects in the order of the catalogue."""
    return tuple(e for e in CATALOGUE.ids if e in effects)


def defaults(effect: str, data: TrialData) -> dict[str, float]:
    """Neutral strengths, typical shapes and known constants of an effect, by full name."""
    found = {}
    for parameter in CATALOGUE[effect].parameters:
        value = parameter.scale if parameter.neutral is None else parameter.neutral
        found[CATALOGUE[effect].parameter_name(parameter.symbol)] = data.stroke if parameter.known else value
    return found


def coordinates(effects: tuple[str, ...], data: TrialData) -> Coordinates:
    """The coordinates of some effects: known constants and degenerate parameters are held."""
    target = data.kernel(effects)
    known = {name: data.stroke for name, p in parameters(target).items() if p.known}
    given = {name: value for name, value in data.given.items() if name in target.parameters}
    free = Coordinates.of(target, known | given, data.force_std)
    most = {"lugre.sigma0": data.stiffest, "mass.m": data.heaviest}
    caps = np.array([most.get(name, np.inf) for name in free.names])
    return replace(free, upper=np.minimum(free.upper, caps))


def problem(
    effects: tuple[str, ...], data: TrialData, grids: Sequence[Grid], freedom: PathFreedom = FINAL, worth: float = 0.0
) -> PathEstimator:
    """The fit of some effects to some grids. freedom, worth : of `NoiseAware`, which alone has paths to estimate."""
    kernel, free = data.kernel(effects), coordinates(effects, data)
    return ImposedMotion(kernel, free, grids) if data.imposed else NoiseAware(kernel, free, grids, freedom, worth)


def along(work: PathEstimator, theta: Array, paths: Sequence[Array], steps: int) -> Estimate | None:
    """The estimate at fixed parameters along paths, after so many steps of them; where the motion is imposed, paths
    follow from the parameters. None where the model diverges.
    """
    return work.along(theta, paths, steps) if isinstance(work, NoiseAware) else work.start(theta)


def extended(here: Kernel, target: Kernel, grid: Grid, path: Array, p: Array) -> Array | None:
    """A path of `here` as one of `target`: what `here` does not have runs along it."""
    wide = np.zeros((len(path), len(target.states)))
    wide[:, : len(target.states) - 2] = target.start(path[0, 0], path[0, 1], path[0, -2])
    shared = [target.states.index(name) for name in here.states]
    wide[:, shared] = path
    run = target.shoot(grid.t, grid.force.u, p, wide, h_max=1e-3, carry=True)
    wide[:, shared] = path
    return None if run.failed is not None or not np.isfinite(wide).all() else wide
