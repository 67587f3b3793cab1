"""What `bristle evaluate` does: names to a plan, the plan run with progress, and the summary for the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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

    with _progress() as progress:
        outcome = evaluate(plan, out, progress, workers or None)
    more = []
    if measured is not None:
        counts = count_alarms(measured, plan.detectors, plan.rate_per_h)
        more = [plant_table(counts, plan.rate_per_h, len(measured) * 2 / 3 / 3600)]
    return outcome, write(outcome, out, more)


@contextmanager
def _progress() -> Iterator[Callable[[str, int, int], None]]:
    """A bar for every stage on a terminal; silent elsewhere."""
    from rich.console import Console
    from rich.progress import Progress, TaskID

    console, tasks = Console(stderr=True), dict[str, TaskID]()
    with Progress(console=console, disable=not console.is_terminal) as shown:

        def progress(label: str, done: int, total: int) -> None:
            if label not in tasks:
                tasks[label] = shown.add_task(label, total=max(total, 1))
            shown.update(tasks[label], completed=done if total else 1)

        yield progress


def summary(outcome: Evaluation) -> object:
    """The first table, for the terminal."""
    from rich.table import Table

    from detector.evaluation import tables

    first = tables(outcome)[0]
    shown = Table(title=first.title, title_justify="left", caption=first.note, caption_justify="left")
    for head in first.heads:
        shown.add_column(head)
    for row in first.rows:
        shown.add_row(*row)
    return shown
