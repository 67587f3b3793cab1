"""What all models of a trace are tried on: recordings to fit, recordings held out, and what is known beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.data.chunks import regular
from identification.data.experiment import Experiment, Segment
from identification.data.grid import Grid, grids
from identification.data.largest_mass import largest_mass
from identification.estimators.coordinates import Coordinates
from identification.estimators.imposed_motion.estimator import ImposedMotion
from identification.estimators.noise_aware.best_paths import BestPathsNoiseAware, freedom_for
from identification.estimators.noise_aware.estimator import NoiseAware
from identification.estimators.noise_aware.linearised_model import PathFreedom
from identification.estimators.noise_aware.mending import MANY, MendedNoiseAware
from identification.estimators.noise_aware.resolution import resolving
from identification.estimators.noise_aware.search import chunk_places
from identification.estimators.path_estimator import PathEstimator
from identification.tracing import settings
from recordings import Array
from simulator import Catalogue, Kernel, kernel

MIN_PART_SAMPLES, CHUNK_NODES = 10, 20
"""Samples that a part of a divided segment has more than, or its motion cannot be smoothed; nodes of a chunk at least,
or the whole recording is fitted."""
COARSE = 2e-3
"""Longest sub-step of fits to chunks [s]: they only choose where to go on."""
ChunkPlace = tuple[int, slice]
"""Where a chunk is: the number of its grid, and the nodes of it."""


@dataclass(frozen=True)
class TrialData:
    """What all models of a trace are tried on.

    experiments, held_out_experiments : the recordings to fit and those held out; fitted, held_out : the grids of their
    segments; given : parameters that are held, by full name, SI units; travel : lowest and highest position seen [m];
    force_std : standard deviation of the force [N]; catalogue : the effects that exist; candidates : those of them that
    can show in what is predicted; imposed : whether the motion is, and the force is predicted; max_mass : that the
    force can have moved so [kg]; max_stiffness : bound on the stiffness of the bristles [N/m], since a rigid stem can
    swallow what is missing; damped : freedom of the paths in damped order, None where the sampling resolves the
    bristle.
    """

    experiments: tuple[Experiment, ...]
    held_out_experiments: tuple[Experiment, ...]
    fitted: tuple[Grid, ...]
    held_out: tuple[Grid, ...]
    given: Mapping[str, float]
    travel: tuple[float, float]
    force_std: float
    catalogue: Catalogue
    candidates: tuple[str, ...]
    imposed: bool = False
    max_mass: float = float("inf")
    max_stiffness: float = float("inf")
    damped: PathFreedom | None = None

    @property
    def stroke(self) -> float:
        """Length of the travel [m]."""
        return self.travel[1] - self.travel[0]

    @property
    def spacing(self) -> float:
        """Longest time between two samples of the fitted recordings [s]."""
        return max(s.dt for e in self.experiments for s in e.segments)

    @property
    def samples(self) -> int:
        """Number of nodes of the fitted grids."""
        return sum(len(grid.t) for grid in self.fitted)

    @property
    def chunk_share(self) -> float:
        """Share of those nodes that lies in chunks."""
        return self.on_chunks()[0].samples / self.samples

    def on_chunks(self) -> tuple[TrialData, list[ChunkPlace]]:
        """The same with chunks of the fitted grids, and where each is: enough for a first fit."""
        if self.imposed:  # memory would have to be found anew in every chunk, and the whole costs little
            return self, [(i, slice(0, len(grid.t))) for i, grid in enumerate(self.fitted)]
        if self.damped is None:
            places = [(i, at) for i, grid in enumerate(self.fitted) for at in _chunks(grid)]
        else:
            places = chunk_places(self.fitted)
        return replace(self, fitted=tuple(self.fitted[i].part(at.start, at.stop) for i, at in places)), places

    def resolving(self, omega: float) -> TrialData:
        """The same with nodes close enough for a swing of omega [rad/s], within reason."""
        return replace(
            self, fitted=tuple(resolving(self.fitted, omega)), held_out=tuple(resolving(self.held_out, omega))
        )

    def damped_for(self, values: Mapping[str, float]) -> TrialData:
        """The same in damped order, with steps close enough for a slip, for parameters by full name."""
        return replace(self, damped=freedom_for(values, self.fitted))

    def in_order(self, *effects: str) -> tuple[str, ...]:
        """Effects in the order of the catalogue."""
        return tuple(e for e in self.catalogue.ids if e in effects)

    def defaults(self, effect: str) -> dict[str, float]:
        """Neutral strengths, typical shapes and known constants of an effect, by full name."""
        found, one = {}, self.catalogue[effect]
        for parameter in one.parameters:
            value = parameter.scale if parameter.neutral is None else parameter.neutral
            found[one.parameter_name(parameter.symbol)] = self.stroke if parameter.known else value
        return found

    def kernel(self, effects: tuple[str, ...]) -> Kernel:
        """The kernel of some effects by which they are fitted."""
        if self.imposed:
            return kernel(effects, "motion", self.catalogue)
        return kernel(effects, "force with error", self.catalogue, damped=self.damped is not None)

    def coordinates(self, effects: tuple[str, ...]) -> Coordinates:
        """The coordinates of some effects: known constants and given parameters are held."""
        target = self.kernel(effects)
        known = {name: self.stroke for name, p in self.catalogue.parameters(effects).items() if p.known}
        given = {name: value for name, value in self.given.items() if name in target.parameters}
        free = Coordinates.of(target, known | given, self.force_std)
        return free.below({"mass.m": self.max_mass, "lugre.sigma0": self.max_stiffness})

    def estimator(
        self, effects: tuple[str, ...], *, coarse: bool = False, worth: float = 0.0,
        learned: tuple[Array, Array] | None = None, judging: bool = False,
    ) -> PathEstimator:  # fmt: skip
        """The fit of some effects to the fitted grids. coarse : in longer sub-steps; worth : of `NoiseAware`, which
        alone has paths; learned : of `Coordinates`; judging : how much of the data a model explains, so that no slip is
        to be missed by the paths alone.
        """
        target, free = self.kernel(effects), replace(self.coordinates(effects), learned=learned)
        if self.imposed:
            return ImposedMotion(target, free, self.fitted)
        if self.damped is not None:
            work = BestPathsNoiseAware(target, free, self.fitted, self.damped, worth, many=1.0 if judging else MANY)
            return work.coarse if coarse else work
        freedom = replace(settings.PATH_FREEDOM, h_max=COARSE) if coarse else settings.PATH_FREEDOM
        if judging:
            return MendedNoiseAware(target, free, self.fitted, freedom, worth, many=1.0)
        return NoiseAware(target, free, self.fitted, freedom, worth)


def trial_data(
    experiments: Sequence[Experiment],
    held_out: Sequence[Experiment],
    given: Mapping[str, float],
    catalogue: Catalogue,
) -> TrialData:
    """The data of some experiments, whose force drives."""
    fitted = grids(experiments)
    x = np.concatenate([grid.motion[:, 0] for grid in fitted])
    force = np.concatenate([grid.force.u for grid in fitted])
    return TrialData(
        tuple(experiments), tuple(held_out), tuple(fitted), tuple(grids(held_out)), dict(given),
        (float(x.min()), float(x.max())), float(np.std(force)), catalogue, catalogue.ids,
        max_mass=largest_mass(experiments),
    )  # fmt: skip


def divided(experiments: Sequence[Experiment], share: float) -> tuple[list[Experiment], list[Experiment]]:
    """The first part of every experiment and the last, which has such a share of the positions that they hold."""
    pairs = [_divided(e, share) for e in experiments]
    return [first for first, _ in pairs], [last for _, last in pairs]


def _divided(e: Experiment, share: float) -> tuple[Experiment, Experiment]:
    """The two parts of one experiment; segments too short to be smoothed are dropped."""
    first, last = list[Segment](), list[Segment]()
    wanted = (1 - share) * sum(int(s.seen.sum()) for s in e.segments)
    for s in e.segments:
        edge = int(np.searchsorted(np.cumsum(s.seen), wanted, side="right"))
        wanted -= int(s.seen.sum())
        if edge > MIN_PART_SAMPLES:
            first.append(s.part(0, edge))
        if len(s.t) - edge > MIN_PART_SAMPLES:
            last.append(s.part(edge, len(s.t)))
    return e.with_segments(tuple(first)), e.with_segments(tuple(last))


def _chunks(grid: Grid) -> list[slice]:
    """Chunks spread over a grid; all of a short one."""
    dt = (grid.t[-1] - grid.t[0]) / (len(grid.t) - 1)
    length, distance = round(settings.CHUNK_LENGTH / dt), round(settings.CHUNK_DISTANCE / dt)
    if len(grid.t) < 2 * distance or length < CHUNK_NODES:
        return [slice(0, len(grid.t))]
    return regular(len(grid.t), length, distance)
