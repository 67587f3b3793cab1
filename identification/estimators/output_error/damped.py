"""The fit where the sampling does not resolve the bristle: output error of the damped model in windows.

The force is smoothed, for its noise would break a stiff bristle away before its time. Free runs are set back to the
data once in every `WINDOW`, where the valve rests or moves evenly: stick-slip forgets its phase over minutes, and what
one slip does says more of friction than when the hundredth happened.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from identification.data.chunks import to_the_ends
from identification.data.experiment import Experiment, Segment
from identification.estimators.anchors import anchors
from identification.estimators.coordinates import Coordinates
from identification.estimators.fitted import Fit, Outcome, fit_of_windows
from identification.estimators.least_squares import Solution, minimise
from identification.estimators.order import LIGHTEST, USUAL, Order, at_rest, slip, slip_is_seen, sub_step, swing_is_over
from identification.estimators.output_error.descent import Minimum
from identification.estimators.output_error.force_position_loop import ForcePositionLoop, force_position_loop
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.estimators.output_error.replicates import in_windows, replicates
from recordings import Array, Progress, silent
from simulator import Kernel, kernel, usual_damping

WINDOW = 0.25
"""A free run is set back to the data once in so many seconds."""
FEWEST = 5
"""Samples between two settings back."""
WIDE, NARROW = 20.0, 3.0
"""Tunings of the Cauchy loss, in sigmas, one after the other: to the first, a slip that is missed is a small error."""
STARTS, STEPS, FEWER = 64, (1, 4, 10), 4
"""Starts, and steps that are made from them in the wide loss. After so many steps those of least cost go on, one in so
many: successive halving (Jamieson and Talwalkar, AISTATS 2016). The cost before any step does not tell a good start."""
TRIALS = 3
"""Replicates."""
SEARCHED, CHUNK = 30.0, 7.5
"""Seconds of the recordings that are searched on, in chunks of so many."""
SAMPLES = 3000
"""Samples that are searched on, about: closer ones are thinned, for a slip takes longer than they are apart."""
LAST = 40
"""Steps in the narrow loss."""
ROUGHLY, GAIN = 1e-3, 3e-5
"""Fall of the cost, as a share of it, that another step has to promise in the wide loss and in the narrow one."""
ABSURD = 1e6
"""Angle [rad] by which a light mass would swing on the spring of the loop from sample to sample, from which that is no
spring: the units are wrong, and steps that follow such a swing have no end."""
FINER = 4
"""Part of the search's sub-step that the last fit takes: the step's own error biases mass, Stribeck velocity and
viscous friction by more than the noise does (at full size by 50 standard deviations, at a quarter by none that shows).
"""
LITTLE = 1e-3
"""Share of the cost that another step may promise when the last fit stops: friction has kinks, and no step keeps it."""
GUESSED = 0.03
"""Share of the level of friction by which a straight line between samples may miss the force; beyond, what the valve
did until the next setting back is not held against the model."""
RANGES = {
    "lugre.fc": (0.5, 1.0), "lugre.fs": (1.0, 1.6), "mass.m": (LIGHTEST, 8.0), "lugre.sigma2": (100.0, 1500.0),
    "lugre.vs": (1e-3, 1e-2), "lugre.sigma0": (3e6, 1e8),
}  # fmt: skip
"""Ranges of the starts, SI units, but for the levels of friction: those are shares of the half width of the loop. It is
the static friction of a valve that sticks and slips, and the Coulomb friction of one that slides through."""
LIKELY = {"mass.m": (0.2, 30.0), "lugre.sigma0": (3e5, 3e8)}
"""Where the search looks for mass [kg] and bristle stiffness [N/m]: beyond, a wrong friction curve drives them. The
last fit is free to leave."""


def search_for(valve: Kernel, coordinates: Coordinates, smooth: Sequence[Experiment], order: Order) -> Search | None:
    """The search for a fit to experiments with a smooth force; None where they make no loop of force over position, or
    one of no spring.

    order : ``damped``, or ``static`` where slips are over between two samples: what only a slip tells is held then.
    """
    loop = force_position_loop(smooth, coordinates.held("spring.K"))
    if loop is None:
        return None
    if order == "static":
        coordinates = coordinates.holding(at_rest(loop.K))
    model = kernel(valve.effects, "force", valve.catalogue, damped=True)
    whole, parts = (Problem(model, coordinates, [_told(e, loop) for e in some]) for some in (smooth, _parts(smooth)))
    absurd = slip({"spring.K": loop.K, "mass.m": LIGHTEST}) * whole.spacing > ABSURD
    return None if absurd else Search(whole, parts, loop)


def fit_in_windows(search: Search, starts: Sequence[Array], order: Order, progress: Progress = silent) -> Fit:
    """The fit from some starting values (n_free,), the likeliest first."""
    whole, coordinates = search.whole, search.coordinates
    progress("fit to whole recordings", 0, 0)
    best = search.best(starts)
    end = None if best is None else search.refined(best.theta[: coordinates.n_free])
    if end is None:
        return Fit(Outcome.DIVERGED, whole.kernel, coordinates)
    form, level = search.form(NARROW, FINER), end.normal.cost / whole.samples
    settled = end.settled or end.left < LITTLE * end.normal.cost
    minimum = Minimum(end.theta, end.normal, form, search.evaluations, settled, level)
    found = fit_of_windows(whole, minimum, replicates(whole, end.theta, form, TRIALS))
    return replace(found, order=order)


def window(spacing: float) -> float:
    """Seconds in which a free run is set back once, for samples `spacing` [s] apart."""
    return max(WINDOW, FEWEST * spacing)


class Search:
    """The way from the loop of force over position to a minimum; whole : the problem, problem : of the parts of the
    recordings that are searched on; usual : values by full name that tell a slip of a usual mass, for no start tells
    it; jumps : whether that is a jump between two samples; shows_slips : whether samples show the course of it.
    """

    def __init__(self, whole: Problem, problem: Problem, loop: ForcePositionLoop) -> None:
        self.whole, self.problem, self.loop = whole, problem, loop
        self.coordinates = c = problem.coordinates
        ends = [LIKELY.get(name, (-np.inf, np.inf)) for name in c.names]
        lower, upper = (np.array(end) for end in zip(*ends, strict=True))
        self.likely = replace(c, lower=np.maximum(c.lower, lower), upper=np.minimum(c.upper, upper))
        self.window = window(problem.spacing)
        self.usual = {"spring.K": loop.K, "mass.m": c.held("mass.m") or USUAL}
        self.jumps = swing_is_over(self.usual, problem.spacing)
        self.shows_slips = slip_is_seen(self.usual, whole.spacing)
        self.h = sub_step({"spring.K": loop.K, "mass.m": LIGHTEST}, problem.spacing)
        self.evaluations = 0

    def form(self, tuning: float, finer: int = 1) -> ResidualForm:
        """How the residual is formed, with a tuning of the loss and a sub-step that is so many times finer.

        The bristle is set to balance where samples show nothing of slips but their ends. Elsewhere that would help a
        model too much that lacks something: a heavy one that never slips would follow.
        """
        return ResidualForm(self.h / finer, self.window, tuning, self.jumps)

    def ends(self, progress: Progress = silent) -> list[Array]:
        """Where the starts lead that go down best in the wide loss, (n_free,), the best first."""
        on, most = [self.problem.start(theta) for theta in self._starts()], STARTS
        for stage, steps in enumerate(STEPS):
            progress("search", stage, len(STEPS))
            on, most = [end.theta for end in self._ranked(on[:most], self.form(WIDE), steps)], most // FEWER
        return [theta[: self.coordinates.n_free] for theta in on]

    def narrowed(self, theta: Array) -> Array | None:
        """Where the narrow loss leads from theta, (n_free,) both; None where the model diverges."""
        end = self.best([theta])
        return None if end is None else end.theta[: self.coordinates.n_free]

    def all_narrowed(self, starts: Sequence[Array]) -> Iterator[Array]:
        """Where the narrow loss leads from some starts, (n_free,) each, when it is asked for."""
        yield from (end for end in map(self.narrowed, starts) if end is not None)

    def best(self, starts: Sequence[Array]) -> Solution | None:
        """The best end of the descents from some starting values (n_free,)."""
        on = [self.problem.start(theta) for theta in starts]
        return next(iter(self._narrowed(on)), None)

    def refined(self, theta: Array) -> Solution | None:
        """The end on whole recordings from theta (n_free,), with sub-steps whose error is below the noise."""
        return self._descent(self.whole, self.whole.start(theta), self.form(NARROW, FINER), LAST, GAIN)

    def _narrowed(self, starts: Sequence[Array]) -> list[Solution]:
        """Where the narrow loss leads from each start, the ends of least cost first."""
        return self._ranked(starts, self.form(NARROW, 2), LAST, GAIN)

    def _ranked(
        self, starts: Sequence[Array], form: ResidualForm, steps: int, tolerance: float = ROUGHLY
    ) -> list[Solution]:
        """Where some steps from each start lead, the ends of least cost first."""
        ends = [self._descent(self.problem, unknowns, form, steps, tolerance) for unknowns in starts]
        return sorted((end for end in ends if end is not None), key=lambda end: end.normal.cost)

    def _descent(
        self, problem: Problem, unknowns: Array, form: ResidualForm, steps: int, tolerance: float
    ) -> Solution | None:  # fmt: skip
        bounds = (self.coordinates if problem is self.whole else self.likely).bounds.padded(len(unknowns))
        evaluate = functools.partial(in_windows, problem, form)
        end = minimise(evaluate, unknowns, bounds=bounds, iterations=steps, tolerance=tolerance)
        self.evaluations += 0 if end is None else end.evaluations
        return end

    def _starts(self) -> list[Array]:
        """Starting values: what the loop tells, and evenly spread what it does not (Sobol's sequence)."""
        default = self.coordinates.defaults
        told = {"spring.K": max(self.loop.K, 1.0), "spring.F0": self.loop.F0}
        ends = np.log(np.array(list(RANGES.values())))
        places = qmc.Sobol(len(RANGES), scramble=False).random(STARTS)
        found = []
        for place in np.exp(ends[:, 0] + places * (ends[:, 1] - ends[:, 0])):
            values = default | told | dict(zip(RANGES, place.tolist(), strict=True))
            for level in ("lugre.fc", "lugre.fs"):
                values[level] *= self.loop.level
            values["lugre.sigma1"] = usual_damping(values["lugre.sigma0"], values["mass.m"])
            found.append(self.coordinates.theta_of(values))
        return found


def _parts(experiments: Sequence[Experiment]) -> list[Experiment]:
    """Chunks spread over the experiments, enough to search on, of samples no closer than that needs."""
    total = sum(float(s.t[-1] - s.t[0]) for e in experiments for s in e.segments)
    share = SEARCHED / total if total > 1.5 * SEARCHED else 1.0
    every = max(1, round(share * sum(e.samples for e in experiments) / SAMPLES))
    return [e.with_segments(tuple(c for s in e.segments for c in _chunks(s, share, every))) for e in experiments]


def _chunks(segment: Segment, share: float, every: int) -> list[Segment]:
    n = len(segment.t)
    size = min(n, round(CHUNK / segment.dt)) if share < 1 else n
    count = max(1, round(share * n / size))
    return [segment.part(at.start, at.stop, every) for at in to_the_ends(n, size, count)]


def _told(e: Experiment, loop: ForcePositionLoop) -> Experiment:
    """The experiment with the samples unseen before which the force is guessed, not known (`GUESSED`)."""
    return e.with_segments(tuple(replace(s, seen=s.seen & _known(s, GUESSED * loop.level)) for s in e.segments))


def _known(segment: Segment, allowed: float) -> NDArray[np.bool_]:
    """Whether the force is known [n_samples] since the valve was last set back."""
    bend = np.zeros(len(segment.t))
    bend[1:-1] = np.abs(np.diff(segment.u, 2)) / 8
    m = segment.motion
    at = anchors(segment.t, m.crept, m.a, window(segment.dt), segment.dt).at
    stretch = np.searchsorted(at, np.arange(len(segment.t)), side="right")
    worst = np.zeros(len(at) + 1)
    np.maximum.at(worst, stretch, bend)
    return np.asarray(worst[stretch] <= allowed, bool)
