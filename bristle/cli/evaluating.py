"""What `bristle evaluate` does: names to a plan, the plan run with progress, and the summary for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bristle.cli.output.tables import words_table
from bristle.cli.output.working import working

if TYPE_CHECKING:
    from rich.table import Table

    from detector.evaluation import Evaluation, Plan


def plan_of(
    detectors: str, scenarios: str, variants: str, seeds: int | None, rate_per_h: float | None, small: bool
) -> Plan:
    """The plan that the options ask for; what is None is as usual, or small. Raises BadInput for unknown names."""
    from detector.evaluation import BENCHMARK, DETECTORS, MAIN, SMOKE, VARIANTS, Plan, smoke

    ways = (MAIN,) if small and variants == "all" else _names(variants, VARIANTS)
    chosen = _names(detectors, tuple(DETECTORS))
    runs = _names(scenarios, SMOKE if small else BENCHMARK)
    plan = replace(smoke(chosen, runs), variants=ways) if small else Plan(chosen, runs, ways)
    if seeds is not None:
        plan = replace(plan, seeds=seeds, long_seeds=min(seeds, 3))
    return plan if rate_per_h is None else replace(plan, rate_per_h=rate_per_h)


def _names(text: str, all_names: tuple[str, ...]) -> tuple[str, ...]:
    """Each name once."""
    return (
        all_names if text == "all" else tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    )


def reported(plan: Plan, out: Path, workers: int, plant: Path | None) -> tuple[Evaluation, list[Path]]:
    """Run a plan with progress on a terminal, count alarms on a plant's record if there is one, and write the files."""
    from detector.evaluation import count_alarms, evaluate, plant_hour, plant_table, write

    measured = None if plant is None else plant_hour(plant)

    with working("evaluating", staged=True) as progress:
        outcome = evaluate(plan, out, progress, workers or None)
    more = []
    if measured is not None:
        counts = count_alarms(measured, plan.detectors, plan.rate_per_h)
        more = [plant_table(counts, plan.rate_per_h, len(measured) * 2 / 3 / 3600)]
    return outcome, write(outcome, out, more)


def results(outcome: Evaluation, files: Sequence[Path]) -> dict[str, Any]:
    """The tables of an evaluation as one object, and the files that were written."""
    from detector.evaluation import tables

    rows = {one.name: [dict(zip(one.heads, row, strict=True)) for row in one.rows] for one in tables(outcome)}
    return {"format": "detector-evaluation", "version": 1, "tables": rows, "files": list(files)}


def summary(outcome: Evaluation) -> Table:
    """The first table, for the terminal."""
    from detector.evaluation import tables

    first = tables(outcome)[0]
    return words_table(first.heads, first.rows, title=first.title, note=first.note)
