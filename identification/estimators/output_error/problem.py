"""Output error as a least-squares problem: several recordings, shared parameters, own initial states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.data.experiment import Experiment, Segment
from identification.estimators.anchors import anchors, deflection_at_rest, held_force
from identification.estimators.coordinates import Coordinates
from identification.estimators.least_squares import Normal, weighted
from identification.parallel import each
from recordings import Array, IndexArray
from simulator import Kernel, Run

HELD = 10.0
"""In a last, plain stage a parameter may move freely by about this factor from where it started; beyond, it costs what
one residual of average size costs, which only matters where the data say nothing."""

MOTION_SCALE, MEMORY_SCALE, MEMORY_STD = 10.0, 1e-3, 1e-3
"""Units of the start of a segment: so many standard deviations of the noise for the motion, and of an initial bristle
deflection [m], with its prior standard deviation [m]. Deflections at break-away, fs/sigma0, go from micrometres to
millimetres; an unknown moves by one unit in a step at most, and a smaller one is walked to in dozens of steps."""

FORGETFUL = 1e6
"""How many times its span a run may move, to first order, if a parameter is changed by a factor of e. A model that
swings by itself forgets where it started; its derivatives then grow without end, and say nothing."""


@dataclass(frozen=True)
class ResidualForm:
    """How the residual is formed: h_max [s] largest sub-step; window [s] after which x and v are set back to the
    smoothed data (inf: never, that is plain output error); tuning : of the Cauchy loss in sigmas (inf: squares);
    balanced : whether the bristle of a valve that rests there is set to where it balances as well.
    """

    h_max: float
    window: float = np.inf
    tuning: float = np.inf
    balanced: bool = False


@dataclass(frozen=True)
class Piece:
    """One segment with what is constant about it: its noise [m or N] and whether its force is held."""

    segment: Segment
    noise: float
    hold: bool


@dataclass(frozen=True)
class Response:
    """A model's answer for one segment: predicted (n_samples,) and by (n_samples, n_free + n_local), sensitivities."""

    predicted: Array
    by: Array | None


class Problem:
    """The residuals of one kernel on some experiments. Unknowns: theta of the coordinates, then each segment's own
    start [x0, v0, free memory...] in units of `local_scale`.
    """

    def __init__(self, kernel: Kernel, coordinates: Coordinates, experiments: Sequence[Experiment]) -> None:
        self.kernel, self.coordinates = kernel, coordinates
        self.experiments = tuple(experiments)
        self.pieces = tuple(Piece(s, _noise(e, kernel), e.hold) for e in experiments for s in e.segments)
        offset = 2 if kernel.causality == "force" else 0
        memory = [i + offset for i, m in enumerate(kernel.layout.memory) if m.free]
        self.local = [*range(offset), *memory]
        self.n_free = coordinates.n_free
        self._known_resets = dict[tuple[int, float], Array]()

    @property
    def n_local(self) -> int:
        """Number of unknowns of one segment's start."""
        return len(self.local)

    @property
    def samples(self) -> int:
        """Number of measured outputs."""
        return sum(int(piece.segment.seen.sum()) for piece in self.pieces)

    @property
    def spacing(self) -> float:
        """Longest time between samples of any segment [s]."""
        return max(piece.segment.dt for piece in self.pieces)

    def local_scale(self, piece: Piece) -> Array:
        """Units of the start of a segment: `MOTION_SCALE` noises for x, as much per sample for v, `MEMORY_SCALE`."""
        x = MOTION_SCALE * piece.noise
        motion = [x, x / piece.segment.dt] if self.kernel.causality == "force" else []
        return np.array([*motion, *[MEMORY_SCALE] * (self.n_local - len(motion))])

    def start(self, theta: Array, *, balanced: bool = False) -> Array:
        """Unknowns with every segment started on its smoothed motion. balanced : with the bristle where it balances the
        forces, if there are one and a spring: soft bristles bend by a millimetre.
        """
        local, values = [], self.coordinates.values(theta)
        balanced = balanced and self.kernel.causality == "force" and {"spring.K", "lugre.sigma0"} <= values.keys()
        for piece in self.pieces:
            first, s = self._first(piece.segment), piece.segment
            if balanced:
                left = s.u[:1] - values.get("mass.m", 0.0) * s.motion.a[:1]
                first[self.kernel.states.index("lugre.z")] = deflection_at_rest(values, left, first[:1])[0]
            local.append(first[self.local] / self.local_scale(piece))
        return np.concatenate([theta, *local])

    def evaluate(self, unknowns: Array, setting: ResidualForm) -> Normal | None:
        """Normal equations of all segments at once; None where the model diverges."""
        answers = self._with_derivatives(unknowns, setting)
        if answers is None:
            return None
        size = self.n_free + self.n_local * len(self.pieces)
        total = Normal(0.0, np.zeros(size), np.zeros((size, size)))
        for i, response in enumerate(answers):
            one = None if response is None else self._normal(i, response, unknowns, setting)
            if one is None:
                return None
            at = np.concatenate([np.arange(self.n_free), self._local_slice(i)])
            total.gradient[at] += one.gradient
            total.matrix[np.ix_(at, at)] += one.matrix
            total = replace(total, cost=total.cost + one.cost)
        return total.plus(self.coordinates.told(unknowns[: self.n_free]))

    def held(self, unknowns: Array, setting: ResidualForm, level: float) -> Callable[[Array], Normal | None]:
        """`evaluate` with a weak hold on the shared parameters where they are now; level : mean square residual."""
        hold = np.zeros(len(unknowns))
        hold[: self.n_free] = max(1.0, level) / np.log(HELD) ** 2

        def evaluate(x: Array) -> Normal | None:
            normal = self.evaluate(x, setting)
            return None if normal is None else normal.with_prior(x, unknowns, hold)

        return evaluate

    def responses(
        self, unknowns: Array, setting: ResidualForm, *, sensitivities: bool = False
    ) -> list[Response | None]:
        """The model's answer for every segment, None for one on which it diverges."""
        if sensitivities:
            together = self._with_derivatives(unknowns, setting)
            return together or [self._alone(i, unknowns, setting) for i in range(len(self.pieces))]
        p = self.coordinates.p(unknowns[: self.n_free])
        runs = [self._given(i, unknowns, setting) for i in range(len(self.pieces))]
        return each(lambda run: self._plain_response(run, p, setting), runs)

    def residual(self, i: int, response: Response) -> Array:
        """Normalised residual of segment i (n_samples,), zero where nothing was measured."""
        piece = self.pieces[i]
        measured = self._measured(piece.segment)
        return np.where(piece.segment.seen, (response.predicted - measured) / piece.noise, 0.0)

    def _measured(self, segment: Segment) -> Array:
        """What the model predicts, as it was measured (n_samples,) [m] or [N]."""
        return segment.y if self.kernel.causality == "force" else segment.u

    def _local_slice(self, i: int) -> IndexArray:
        return np.arange(self.n_free + i * self.n_local, self.n_free + (i + 1) * self.n_local)

    def _normal(self, i: int, response: Response, unknowns: Array, setting: ResidualForm) -> Normal | None:
        if response.by is None:
            return None
        piece = self.pieces[i]
        jacobian = np.where(piece.segment.seen[:, None], response.by / piece.noise, 0.0)
        normal = weighted(self.residual(i, response), jacobian, setting.tuning)
        return _with_memory_prior(normal, unknowns[self._local_slice(i)], self.n_free, self.kernel.causality)

    def _given(self, i: int, unknowns: Array, setting: ResidualForm) -> Run:
        """What the run of segment i is given."""
        piece, kernel = self.pieces[i], self.kernel
        segment, s0 = piece.segment, self._first(piece.segment)
        s0[self.local] = unknowns[self._local_slice(i)] * self.local_scale(piece)
        held = piece.hold and kernel.causality == "force"
        resets = self._resets(segment, setting.window)
        if setting.balanced and resets is not None:
            resets = self._balanced(resets, segment, self.coordinates.values(unknowns[: self.n_free]))
        return Run(segment.t, self._input(segment), s0, held, resets)

    def _with_derivatives(
        self, unknowns: Array, setting: ResidualForm, some: Sequence[int] = ()
    ) -> list[Response | None] | None:  # fmt: skip
        """The answers for all segments, or for some, with sensitivities; None where the model diverges on one."""
        p, chosen = self.coordinates.p(unknowns[: self.n_free]), some or range(len(self.pieces))
        columns = tuple(np.flatnonzero(self.coordinates.free).tolist())
        runs = [self._given(i, unknowns, setting) for i in chosen]
        found = self.kernel.run_together(runs, p, columns, h_max=setting.h_max)
        return None if found is None else [self._response(i, p, *one) for i, one in zip(chosen, found, strict=True)]

    def _alone(self, i: int, unknowns: Array, setting: ResidualForm) -> Response | None:
        """The answer for segment i with sensitivities, whatever happens on the others."""
        found = self._with_derivatives(unknowns, setting, (i,))
        return None if found is None else found[0]

    def _plain_response(self, given: Run, p: Array, setting: ResidualForm) -> Response | None:
        t, u, s0, hold, resets = given
        run = self.kernel.run(t, u, p, s0, h_max=setting.h_max, hold=hold, resets=resets)
        return None if run.failed is not None else Response(run.outputs[:, 0], None)

    def _response(self, i: int, p: Array, outputs: Array, jacobian: Array) -> Response | None:
        """The answer for segment i of a run (n_samples, 1) with its derivatives (n_samples, 1, n_free + n_states); None
        where the model has forgotten its start.
        """
        piece, predicted, columns = self.pieces[i], outputs[:, 0], jacobian[:, 0]
        by_p = columns[:, : self.n_free] * self.coordinates.slope(p)
        span = max(np.ptp(self._measured(piece.segment)), np.ptp(predicted))
        if np.max(np.abs(by_p), initial=0.0) > FORGETFUL * span:
            return None
        return Response(
            predicted, np.hstack([by_p, columns[:, self.n_free :][:, self.local] * self.local_scale(piece)])
        )

    def _first(self, segment: Segment) -> Array:
        """The state at the beginning of a segment as the recording shows it."""
        force = segment.u if self.kernel.causality == "force" else segment.load
        return self.kernel.start(segment.motion.x[0], segment.motion.v[0], force[0])

    def _input(self, segment: Segment) -> Array:
        if self.kernel.causality == "force":
            return segment.u
        m = segment.motion
        return np.column_stack([m.x, m.crept, m.a, segment.load])

    def _resets(self, segment: Segment, window: float) -> Array | None:
        if np.isinf(window) or self.kernel.causality == "motion":
            return None
        key = id(segment), window  # of a piece, so it lives as long as the problem
        if key not in self._known_resets:
            resets, m = np.full((len(segment.t), len(self.kernel.states)), np.nan), segment.motion
            at, rest = anchors(segment.t, m.crept, m.a, window, segment.dt)
            resets[at, 0], resets[at, 1] = m.x[at], np.where(rest, 0.0, m.v[at])
            self._known_resets[key] = resets
        return self._known_resets[key]

    def _balanced(self, resets: Array, segment: Segment, values: Mapping[str, float]) -> Array:
        """Resets (n_samples, n_states) with the bristle where it balances, wherever the valve can rest. One that
        balances elsewhere swings, and breaks away before its time. values : parameters by full name.
        """
        found, at = resets.copy(), np.flatnonzero(resets[:, 1] == 0.0)
        held = at[np.abs(held_force(values, segment.u[at], resets[at, 0])) < values["lugre.fs"]]
        z = self.kernel.states.index("lugre.z")
        found[held, z] = deflection_at_rest(values, segment.u[held], resets[held, 0])
        return found


def _noise(experiment: Experiment, kernel: Kernel) -> float:
    return experiment.noise_position if kernel.causality == "force" else experiment.noise_force


def _with_memory_prior(normal: Normal, local: Array, n_free: int, causality: str) -> Normal:
    """A weak prior on the initial memory: where nothing moves at first, nothing else would hold it."""
    first = 2 if causality == "force" else 0
    precision = np.zeros(len(normal.gradient))
    precision[n_free + first :] = (MEMORY_SCALE / MEMORY_STD) ** 2
    return normal.with_prior(np.concatenate([np.zeros(n_free), local]), np.zeros(len(precision)), precision)
