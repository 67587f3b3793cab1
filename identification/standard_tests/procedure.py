"""A standard test from recordings to its result."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

from identification.standard_tests.comparison import changes
from identification.standard_tests.dead_band import dead_band_values
from identification.standard_tests.error_band import error_band_values
from identification.standard_tests.partial_stroke import partial_stroke_values
from identification.standard_tests.result import ValveTest, plain, reference_values
from identification.standard_tests.run import ValveRun, run_of
from identification.standard_tests.signature import signature_values
from identification.standard_tests.step_response import step_values
from recordings import BadInput, BadParameter, Progress, Recording, silent

TestKind = Literal["step", "deadband", "signature", "partial-stroke", "error-band"]
KINDS: tuple[TestKind, ...] = get_args(TestKind)


def standard_test(
    recordings: Sequence[Recording],
    kind: TestKind,
    reference: str | os.PathLike[str] | ValveTest | None = None,
    progress: Progress = silent,
) -> ValveTest:
    """A standard test of a valve from recordings of it.

    reference : an earlier test of the same kind, to say what changed beyond the noise of both; progress : told when
    the recordings turned out to hold such a test.

    Raises BadInput where the recordings do not hold such a test, BadParameter for a kind that there is not.
    """
    if kind not in KINDS:
        raise BadParameter("kind", kind, "there is no such test", f"use {', '.join(KINDS)}")
    if not recordings:
        raise BadInput("recordings", "there are none", "give at least one recording")
    known = None if reference is None else _values_of(reference, kind)
    problems: list[str] = []
    values = _values(recordings, kind, problems)
    progress("drawing", 0, 0)
    changed = None if known is None else tuple(changes(known, plain(values)))
    tag = next((one.plant.tag for one in recordings if one.plant.tag), None)
    return ValveTest(kind, values, changed, tuple(problems), _curves(recordings, kind), tag, _names(recordings))


def _names(recordings: Sequence[Recording]) -> tuple[str, ...]:
    return tuple(Path(one.label).name for one in recordings)


def _values(recordings: Sequence[Recording], kind: TestKind, problems: list[str]) -> dict[str, Any]:
    if kind == "signature":
        return signature_values(recordings, problems)
    runs = [run_of(one) for one in recordings]
    if kind == "step":
        values = step_values(runs, problems)
    elif kind == "deadband":
        values = dead_band_values(runs, problems)
    elif kind == "error-band":
        values = error_band_values(runs, problems)
    else:
        values = partial_stroke_values(recordings, runs, problems)
    return {name: value for name, value in values.items() if value is not None}


def _values_of(reference: str | os.PathLike[str] | ValveTest, kind: TestKind) -> Mapping[str, Any]:
    if not isinstance(reference, ValveTest):
        return reference_values(reference, kind)
    if reference.kind != kind:
        raise BadParameter("reference", reference.kind, f"the test is of the kind {kind}", "give one of the same kind")
    return dict(plain(reference.values))


def _curves(recordings: Sequence[Recording], kind: TestKind) -> dict[str, Any]:
    """What the page draws: input against travel for a signature, else travel over time."""
    if kind == "signature":
        runs = [run_of(one, ("pressure", "force")) for one in recordings]
        axes = ("stem [% of span]", f"{runs[0].driver} [{runs[0].unit}]")
        return {f"signature {i + 1}": (*axes, [(run.name, run.position, run.driven)]) for i, run in enumerate(runs)}
    return {f"run {i + 1}": _over_time(run_of(one)) for i, one in enumerate(recordings)}


def _over_time(run: ValveRun) -> tuple[str, str, list[tuple[str, Any, Any]]]:
    lines = [("stem", run.t, run.position)]
    if run.driven is not None and run.unit == "%":
        lines.insert(0, (str(run.driver), run.t, run.driven))
    return "time [s]", "% of span", lines
