"""Partial stroke: whether a valve that mostly stands still breaks away, how soon, and whether it comes back.

T86 is that of ANSI/ISA-75.25.01. The reasons to call it failed are those for which positioners abort the test: no
break-away, travel not reached, overshoot past the limit, not back at the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identification.standard_tests.interval import Interval
from identification.standard_tests.plateaus import held_steps
from identification.standard_tests.run import ValveRun
from identification.standard_tests.step_response import step_values
from recordings import BadInput, Recording

REACHED = 0.865
"""Share of the asked travel that must be reached."""
TOO_FAR = 0.5
"""Overshoot, share of the asked travel, that aborts."""
BACK = 0.1
"""Distance from the start at the end, share of the asked travel, that is still back."""


def partial_stroke_values(
    recordings: Sequence[Recording], runs: Sequence[ValveRun], problems: list[str]
) -> dict[str, Any]:
    """Break-away, T86, travel and the reasons to abort. Raises BadInput where the recordings have no partial stroke."""
    values: dict[str, Any] = {"abort_reasons": []}
    for recording, run in zip(recordings, runs, strict=True):
        if run.driven is None or run.unit != "%":
            found = "there is neither a set point nor a drive signal"
            raise BadInput(run.name, found, "record what was asked of the valve")
        steps = held_steps(run)
        if len(steps) < 2:
            raise BadInput(run.name, "the set point does not step out and back", "record the whole partial stroke")
        values["abort_reasons"] += _reasons(run, steps[0].start, steps[1].start, steps[-1].end, abs(steps[0].size))
        try:
            found_steps = step_values([run], problems)["steps"]
        except BadInput:
            continue
        out = found_steps[0]
        values |= {"break_away_s": out["Td_s"], "T86_s": out.get("T86_s"), "travel_percent": _size(out)}
        if "pressure" in recording and "Td_s" in out:
            values["break_away_kPa"] = _pressure_at(recording, run.t[steps[0].start], out["Td_s"].value)
    return {name: value for name, value in values.items() if value is not None}


def _size(step: dict[str, Any]) -> Interval:
    travel: Interval = step["travel_percent"]
    return travel if travel.value >= 0 else travel.scaled(-1.0)


def _reasons(run: ValveRun, out: int, back: int, end: int, asked: float) -> list[str]:
    """Why the stroke failed, in words; empty where it did not."""
    start = float(run.position[max(0, out - 5) : out].mean())
    moved = abs(run.position[out:back] - start)
    if float(moved.max()) <= 4 * run.noise + 0.02 * asked:
        return [f"{run.name}: the stem did not break away"]
    reasons = []
    if float(moved.max()) < REACHED * asked:
        reasons.append(f"{run.name}: the stem went {moved.max():.3g} % of span, {asked:.3g} % were asked")
    if float(moved.max()) > (1 + TOO_FAR) * asked:
        reasons.append(f"{run.name}: the stem went {moved.max():.3g} % of span, too far for the {asked:.3g} % asked")
    if abs(float(run.position[end - 3 : end].mean()) - start) > BACK * asked + 4 * run.noise:
        reasons.append(f"{run.name}: the stem did not come back to where it started")
    return reasons


def _pressure_at(recording: Recording, step_s: float, delay_s: float) -> Interval:
    """Change of the chamber pressure from the step to the first motion [kPa]; a sample's time either way."""
    pressure, t = recording.si("pressure").values, recording.time
    index = [int(abs(t - moment).argmin()) for moment in (step_s, step_s + delay_s)]
    before, at = (float(pressure[i]) for i in (max(0, index[0] - 1), index[1]))
    around = pressure[max(0, index[1] - 1) : index[1] + 2]
    return Interval(at - before, float(around.min()) - before, float(around.max()) - before).scaled(1e-3)
