"""From models to the next test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identification.next_test.bounds import DRIVES, DesignBounds, DrivenBy
from identification.next_test.drive import StemDrive, drive_of
from identification.next_test.expectation import TOLD, Expectation, expectation
from identification.next_test.information import answered, rehearsed
from identification.next_test.knowledge import DrivenTest, known_valve
from identification.next_test.proposal import NextTest
from identification.next_test.search import DesignAim, FoundSequence, allowed, searched
from identification.next_test.waveforms import REFERENCES
from recordings import Array, BadInput, BadParameter, NegativeAnswer, Progress, silent
from simulator import CATALOGUE, Catalogue, ValveModel

COARSE, FINE = 1e-3, 2.5e-4
"""Longest sub-steps of the search and of what is expected in the end [s]."""
SHRUNK = 0.9
"""By how much a reference test is made smaller, about its middle, until it keeps the travel."""
LEAST = 0.1
"""Range of a demand below which a reference test is not made smaller."""
SUPPOSED = 4
"""Valves that each model may be, over which the search averages."""
FINALISTS, REHEARSED = 2, 2
"""Families whose expectation is worked out in full, and valves on which the test of a single model is rehearsed."""


def next_test(
    models: Mapping[str, ValveModel],
    bounds: DesignBounds,
    *,
    drive: DrivenBy | None = None,
    sampling: float = 100.0,
    bends: int = 12,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> NextTest:
    """The test that tells most: between models, by their names, that recordings could not tell apart, or of the weak
    parameters of a single one.

    drive : what the sequence asks, by default the pressure where the area is known, else the force; sampling [Hz];
    bends : how long the best families are bent; catalogue : where effects are looked up.

    Raises BadInput for a model that cannot be used and for limits that leave nothing, BadParameter for a drive that
    there is not, NegativeAnswer where no sequence keeps the limits.
    """
    if not models:
        raise BadInput("models", "there are none", "give a model.json or a trace.json")
    if drive is not None and drive not in DRIVES:
        raise BadParameter("drive", drive, "there is no such drive", f"use {', '.join(DRIVES)}")
    if not 1.0 <= sampling * bounds.duration <= 1e6 or not sampling >= 5.0:
        raise BadParameter("sampling", f"{sampling:g}", "it is too slow or too fast", "give 5 to 1000 samples a second")
    valves = tuple(known_valve(name, model, catalogue) for name, model in models.items())
    first = valves[0]
    chosen: DrivenBy = drive or ("force" if first.area is None else "pressure")
    course = drive_of(first, chosen, bounds)
    aim = DesignAim(valves, first.weak or first.names, tuple(one.supposed(SUPPOSED) for one in valves))
    t = np.arange(round(bounds.duration * sampling) + 1) / sampling
    found = allowed(searched(aim, course, t, COARSE, bends, progress))
    if not found:
        raise NegativeAnswer("no sequence keeps the travel: allow more travel, or less rate or pressure")
    references = _references(aim, course, t)
    progress("expectation", 0, 0)
    finalists = [*(_judged(aim, course, t, one) for one in found[:FINALISTS]), *references.values()]
    best = max((one for one in finalists if one.expected), key=lambda one: one.rank, default=None)
    if best is None or best.expected is None:
        raise NegativeAnswer("no model answers the sequences with a finite motion: check the parameters of the models")
    column, values = course.shown(course.asked(t, best.sequence.demand))
    others = {name: one.expected for name, one in references.items() if one.expected}
    asked = {name: course.shown(course.asked(t, references[name].sequence.demand))[1] for name in others}
    return NextTest(best.sequence.family, bounds, t, column, values, valves, aim.weak, best.expected, others, asked)


@dataclass(frozen=True)
class Finalist:
    """A sequence; expected : in full, None where a model diverges; rank : the larger one is the better sequence."""

    sequence: FoundSequence
    expected: Expectation | None
    rank: tuple[float, float]


def _judged(aim: DesignAim, course: StemDrive, t: Array, one: FoundSequence) -> Finalist:
    """By the distance of rivals that are really fitted, as far as it tells: at their present values rivals may be alike
    that differ at the true ones. A single model by rehearsals: the test is run on valves that it may be, and fitted.
    """
    test = course.test(t, course.asked(t, one.demand), FINE)
    expected = expectation(aim.valves, test)
    if len(aim.valves) == 1:
        trials = [rehearsed(true, aim.valves[0], test, aim.weak) for true in aim.supposed[0][:REHEARSED]]
        return Finalist(one, expected, (float(np.mean(trials)), one.worth))
    told = 0.0 if expected is None or expected.distance < TOLD else expected.distance
    return Finalist(one, expected, (told, one.worth))


def _references(aim: DesignAim, course: StemDrive, t: Array) -> dict[str, Finalist]:
    """What everybody's tests achieve within the same limits, made smaller until they keep the travel."""
    found = {}
    for name, wave in REFERENCES.items():
        demand = wave(t / t[-1])
        test = course.test(t, course.asked(t, demand), FINE)
        while not _keeps(aim, course, test) and np.ptp(demand) > LEAST:
            demand = 0.5 + SHRUNK * (demand - 0.5)
            test = course.test(t, course.asked(t, demand), FINE)
        worth = aim.worth(course.test(t, course.asked(t, demand), COARSE), course)
        found[name] = _judged(aim, course, t, FoundSequence(name, demand, worth))
    return found


def _keeps(aim: DesignAim, course: StemDrive, test: DrivenTest) -> bool:
    """Whether every model expects the stem to keep the travel."""
    answers = [(valve, answered(valve, test)) for valve in aim.valves]
    return all(one is not None and course.keeps(one.y, valve) for valve, one in answers)
