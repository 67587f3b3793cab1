"""Whether the recordings of a case show its effects: what the plant's own parameters gain over the base model.

An effect of a given strength leaves as much in a free run on the exact force. A noisy force forgives more, so some of
them cannot be told from chance on the recordings that a trace sees. Where the truth gains much and the trace found
little, its search failed.
"""

from __future__ import annotations

from collections.abc import Mapping

from benchmarks.plants.cases import Case
from benchmarks.plants.effects import Valve
from benchmarks.plants.recordings import recordings
from benchmarks.plants.truth import PARAMETERS, true_values
from identification import gain_of_values


def has_truth(case: Case) -> bool:
    """Whether a case has effects whose law the catalogue has, so that its truth can be fitted."""
    return case.form == "same" and not case.rig and bool(case.effects) and {*case.effects} <= {*PARAMETERS}


def gain_of_truth(case: Case, given: Mapping[str, float] | None = None) -> float:
    """By how much the cost of the base model falls with the effects of a case, fitted on from the truth; NaN where that
    cannot be fitted. given : base parameters that the trace knows.
    """
    fitted, held_out, strengths = recordings(case)
    truth = true_values(strengths, Valve.of(case.valve))
    return gain_of_values(fitted, case.effects, truth, holdout=held_out, given=given)
