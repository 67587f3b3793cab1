"""The demo traces what the model of its valve lacks, in what it has recorded."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from bristle.cli import tracing
from bristle.cli.output.working import working
from identification import Trace, trace
from recordings import NegativeAnswer, read

BUDGET_S = 5 * tracing.BUDGET_S
"""Time of the trace [s]: it takes four minutes of processor time, and on a busy core 120 s end before a name."""


def trace_stage(recorded: Sequence[Path], out: Path, console: Console) -> Path:
    """Trace the effect that the model does not have; the last recording judges. The file of the traced model.

    Raises NegativeAnswer when none is found, or it does not explain the data set aside better.
    """
    *fitted, held = map(read, recorded)
    console.print("Tracing: the model of spring and friction is fitted, and what it leaves is tested for every effect.")
    with working("tracing", staged=True, budget=BUDGET_S) as progress:
        found = trace(fitted, holdout=[held], budget=BUDGET_S, progress=progress)
    console.print(tracing.candidate_table(found), soft_wrap=False)
    for sentence in found.sentences():
        console.print(sentence)
    found.write(out / "trace.json")
    found.model.write(out / "traced.json")
    found.report(out / "trace.html")
    if not found.effects_added:
        raise NegativeAnswer(f"tracing ended with '{found.verdict}': no effect was named")
    before, after = (error_mm(found, side) for side in ("before", "after"))
    console.print(f"Error on data set aside: {before:.3f} mm before, {after:.3f} mm after {found.verdict} was added.")
    if not after < before:
        raise NegativeAnswer("the traced effect does not explain the data set aside better")
    return out / "traced.json"


def error_mm(found: Trace, side: str) -> float:
    """Free-run error on data that neither fitted nor judged [mm]."""
    return 1e3 * float(found.error[side][found.reported]["rmse_m"])
