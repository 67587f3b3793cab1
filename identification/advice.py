"""Which further experiment would pin what is not known, in words: only one that the fitted model says would.

Every experiment is run on the fitted model, in full order. What it would tell is added to what the recordings do: the
sum of both information matrices (Atkinson, Donev and Tobias, Optimum Experimental Designs, with SAS, 2007, chapter 10).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from identification.data.experiment import Experiment, experiment
from identification.estimators.fitted import FREE_STEP, Fit, Outcome
from identification.estimators.output_error.problem import Problem, ResidualForm
from identification.uncertainty.covariance import NINETY, PRIOR_LOG_STD, WEAK, Uncertainty, inverse, rate_that_shows
from recordings import Array, BadInput
from simulator import Excitation, Sensors, kernel, simulate


class FurtherTest(NamedTuple):
    """A further experiment. words : what to record, and why it teaches; excitation : as the simulator runs it."""

    words: str
    excitation: str


STROKES = FurtherTest("a slow sine or ramp over a good part of the stroke, in both directions", "ramp:20,sine:20")
TESTS = {
    "mass.m": FurtherTest(
        "fast steps or a multisine up to several hertz: the mass shows only when the stem accelerates", "multisine:6"
    ),
    "spring.K": STROKES,
    "spring.F0": STROKES,
    "lugre.fc": FurtherTest("a slow sine with several reversals at different positions", "sine:20,staircase:10"),
    "lugre.fs": FurtherTest(
        "steps from rest, with a pause before each, so that the stem breaks away often", "staircase:20,sine:20"
    ),
    "lugre.vs": FurtherTest(
        "steps from rest and very slow ramps: the Stribeck region is passed only at low speed", "staircase:10,ramp:20"
    ),
    "lugre.sigma0": FurtherTest(
        "presliding: a small sine below break-away about a position at rest, finely resolved", "presliding:20"
    ),
    "lugre.sigma1": FurtherTest(
        "small steps and presliding: the bristle damping shows for some milliseconds only", "staircase:5,presliding:5"
    ),
    "lugre.sigma2": FurtherTest(
        "strokes at several speeds: viscous friction is told from Coulomb friction by its slope", "chirp:10,sine:20"
    ),
}
"""Parameter -> the experiment that teaches it."""
ANY = FurtherTest("more varied motion", "mixed:40")
CLOSE = 1000.0
"""Samples a second that an experiment may ask for, where the rate of the recordings does not do."""
SLIPS = "staircase:5,sine:5"
"""What is to say whether a rate shows a parameter: slips and rests enough."""
LITTLE = 1e-3
"""Share of its scale below which a value has no size of its own."""
MOST = 200_000
"""Samples of an experiment beyond which nobody records one, as for the swing of a stem that is all but weightless."""
FORGETS = 1.0
"""The run of an experiment forgets at a rest once in so many seconds: over many slips it promises too much."""


def advice(known: Uncertainty, found: Fit) -> tuple[str, ...]:
    """What to record: a sentence for every parameter that is weak or at its bound and that an experiment would pin, and
    for all that the sampling does not tell, with the rate that would show it where it would.
    """
    teaching, sentences = Teaching(known, found), []
    for name, status in known.status.items():
        if status in ("weak", "at_bound"):
            usual = "the recordings say little about it" if status == "weak" else "it went to its bound"
            test = teaching.test_for(name)
            sentences += [f"{name}: {known.note.get(name, usual)}; to pin it, record {test}."] if test else []
    unresolved: dict[str, list[str]] = {}
    for name in (name for name, status in known.status.items() if status == "unresolved"):
        why = known.note[name]
        shown = found.outcome is not Outcome.CONVERGED or teaching.shows(name, rate_that_shows(found, name))
        unresolved.setdefault(why if shown else why.split(";")[0], []).append(name)
    return (*sentences, *(f"{', '.join(n)}: not told by these recordings: {why}." for why, n in unresolved.items()))


@dataclass(frozen=True)
class Teaching:
    """What experiments would teach beside the recordings of a fit. done : standard deviations, by experiment; moved :
    the same for fits that lie at the ends of an interval, by parameter.
    """

    known: Uncertainty
    found: Fit
    done: dict[tuple[str, float], dict[str, float]] = field(default_factory=dict)
    moved: dict[str, tuple[Teaching, ...]] = field(default_factory=dict)

    def test_for(self, name: str) -> str:
        """The experiment that would pin a parameter, at the rate of the recordings or a higher one; empty without."""
        assert self.found.problem is not None
        if self.known.spread[name] <= self._enough(name):
            return ""
        test, rate = TESTS.get(name, ANY), 1 / self.found.problem.spacing
        for samples, where in ((rate, ""), (CLOSE, f", at {CLOSE:.0f} samples a second")):
            if samples >= rate and self._pins(name, test.excitation, samples):
                return test.words + where
        return ""

    def _pins(self, name: str, excitation: str, rate: float) -> bool:
        """Whether an experiment would pin a parameter whatever it is: as fitted, and at the ends of its interval."""
        told = self.expected(excitation, rate)[name] <= self._enough(name)
        return told and all(end.expected(excitation, rate)[name] <= end._enough(name) for end in self._ends(name))

    def _ends(self, name: str) -> tuple[Teaching, ...]:
        """The same at the ends of the 90 % interval of a parameter, where the others are as likely there."""
        if name not in self.moved:
            assert self.found.minimum is not None
            minimum, n, place = self.found.minimum, len(self.known.names), self.known.names.index(name)
            way = NINETY * self.known.correlation[:, place] * self._std()
            ends = (np.r_[minimum.unknowns[:n] + sign * way, minimum.unknowns[n:]] for sign in (-1.0, 1.0))
            fits = (replace(self.found, minimum=replace(minimum, unknowns=end)) for end in ends)
            self.moved[name] = tuple(Teaching(self.known, fit) for fit in fits)
        return self.moved[name]

    def _std(self) -> Array:
        """Standard deviations of the coordinates, (n_free,), of what is hardly known as before the fit."""
        slope = np.abs(self.found.coordinates.slope(self.found.p))
        std = np.array([self.known.spread[name] for name in self.known.names]) / np.maximum(slope, 1e-300)
        return np.minimum(std, PRIOR_LOG_STD)

    def shows(self, name: str, rate: float) -> bool:
        """Whether a rate [Hz] would tell a parameter, in slips and at rest."""
        return self.expected(SLIPS, rate)[name] <= self._enough(name)

    def _enough(self, name: str) -> float:
        """The standard deviation of a parameter from which it is not weak, in its unit."""
        scale = dict(zip(self.found.kernel.parameters, self.found.coordinates.scale.tolist(), strict=True))[name]
        value = abs(self.found.values[name])
        return float(WEAK * (value if value > LITTLE * scale else scale))

    def expected(self, excitation: str, rate: float) -> dict[str, float]:
        """Standard deviations by name after one more experiment at a rate [Hz], in the units of the parameters; those
        before it where the model cannot run it.
        """
        if (excitation, rate) not in self.done:
            told = _information(self.found, excitation, rate)
            self.done[excitation, rate] = self.known.spread if told is None else self._after(told)
        return self.done[excitation, rate]

    def _after(self, told: Array) -> dict[str, float]:
        """The same from the information of the experiment (n_free, n_free). What the recordings are not trusted to tell
        has only the weak hold of the fit before.
        """
        known, slope = self.known, np.abs(self.found.coordinates.slope(self.found.p))
        trusted = np.array([known.status[name] != "unresolved" for name in known.names])
        std = np.where(trusted, self._std(), PRIOR_LOG_STD)
        together = (trusted[:, None] & trusted) | np.eye(len(std), dtype=bool)
        before = np.where(together, known.correlation, 0.0) * np.outer(std, std)
        spread = np.sqrt(np.maximum(np.diag(inverse(np.linalg.pinv(before) + told)), 0.0)) * slope
        return dict(zip(known.names, spread.tolist(), strict=True))


def _information(found: Fit, excitation: str, rate: float) -> Array | None:
    """What an experiment at a rate [Hz] tells of the coordinates, (n_free, n_free), wherever the stem starts. None
    where the model cannot run it, as without a spring, or nobody would.
    """
    assert found.problem is not None
    assert found.minimum is not None
    made = _experiment(found, excitation, rate)
    if made is None:
        return None
    problem = Problem(kernel(found.kernel.effects, "force", found.kernel.catalogue), found.coordinates, [made])
    start = problem.start(found.minimum.unknowns[: problem.n_free])
    normal = problem.evaluate(start, ResidualForm(FREE_STEP, FORGETS))
    if normal is None:
        return None
    free, own = slice(0, problem.n_free), slice(problem.n_free, None)
    across = normal.matrix[free, own]
    return np.asarray(normal.matrix[free, free] - across @ np.linalg.pinv(normal.matrix[own, own]) @ across.T)


def _experiment(found: Fit, excitation: str, rate: float) -> Experiment | None:
    """An experiment at a rate [Hz] as the fitted model answers it, with the noise that the recordings have. The noise
    of the force counts by what it moves the spring.
    """
    assert found.problem is not None
    experiments, values = found.problem.experiments, found.values
    course = Excitation.parse(excitation)
    if not values.get("spring.K") or course.duration * rate > MOST:
        return None
    x = np.concatenate([s.motion.x for e in experiments for s in e.segments])
    stroke = float(experiments[0].plant.get("stroke_m") or np.ptp(x))
    noise = max(float(np.hypot(e.noise_position, e.noise_force / values["spring.K"])) for e in experiments)
    try:
        run, _ = simulate(
            values, course, Sensors(rate), stroke=stroke, effects=found.kernel.effects,
            catalogue=found.kernel.catalogue,
        )  # fmt: skip
        made = experiment(run)
    except BadInput:  # it cannot be run at this stroke, or has too few samples at this rate
        return None
    return replace(made, noise_position=noise * max(1.0, found.rms))
