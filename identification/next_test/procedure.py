"""From models to the next test."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from identification.next_test.bounds import DRIVES, DesignBounds, DrivenBy
from identification.next_test.drive import StemDrive, drive_of
from identification.next_test.expectation import Expectation, expectation
from identification.next_test.information import answered
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
"""Valves that a single model may be, over which the search averages."""
FINALISTS = 2
"""Families whose expectation is worked out in full."""


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
    aim = DesignAim(valves, first.weak or first.names, first.supposed(SUPPOSED) if len(valves) == 1 else ())
    t = np.arange(round(bounds.duration * sampling) + 1) / sampling
    found = allowed(searched(aim, course, t, COARSE, bends, progress))
    if not found:
        raise NegativeAnswer("no sequence keeps the travel: allow more travel, or less rate or pressure")
    references = _references(aim, course, t)
    progress("expectation", 0, 0)
    judged = [(one, _judged(aim, course, t, one)) for one in found[:FINALISTS]]
    best = _best([*judged, *references.values()], len(valves) > 1)
    if best is None:
        raise NegativeAnswer("no model answers the sequences with a finite motion: check the parameters of the models")
    sequence, expected = best
    column, values = course.shown(course.asked(t, sequence.demand))
    others = {name: one for name, (_, one) in references.items() if one is not None}
    asked = {name: course.shown(course.asked(t, references[name][0].demand))[1] for name in others}
    return NextTest(sequence.family, bounds, t, column, values, valves, aim.weak, expected, others, asked)


def _judged(aim: DesignAim, course: StemDrive, t: Array, one: FoundSequence) -> Expectation | None:
    return expectation(aim.valves, course.test(t, course.asked(t, one.demand), FINE))


def _best(
    judged: list[tuple[FoundSequence, Expectation | None]], rivals: bool
) -> tuple[FoundSequence, Expectation] | None:
    """The sequence with the largest distance when rivals are really fitted; for parameters the one of most worth."""
    known = [(one, expected) for one, expected in judged if expected is not None]
    if not known:
        return None
    return max(known, key=lambda pair: pair[1].distance if rivals else pair[0].worth)


def _references(aim: DesignAim, course: StemDrive, t: Array) -> dict[str, tuple[FoundSequence, Expectation | None]]:
    """What everybody's tests achieve within the same limits, made smaller until they keep the travel."""
    found = {}
    for name, wave in REFERENCES.items():
        demand = wave(t / t[-1])
        test = course.test(t, course.asked(t, demand), FINE)
        while not _keeps(aim, course, test) and np.ptp(demand) > LEAST:
            demand = 0.5 + SHRUNK * (demand - 0.5)
            test = course.test(t, course.asked(t, demand), FINE)
        worth = aim.worth(course.test(t, course.asked(t, demand), COARSE), course)
        found[name] = FoundSequence(name, demand, worth), expectation(aim.valves, test)
    return found


def _keeps(aim: DesignAim, course: StemDrive, test: DrivenTest) -> bool:
    """Whether every model expects the stem to keep the travel."""
    answers = [(valve, answered(valve, test)) for valve in aim.valves]
    return all(one is not None and course.keeps(one.y, valve) for valve, one in answers)
