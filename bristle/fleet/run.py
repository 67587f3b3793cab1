"""A fleet from start to end: what is to be done, what is done already, and every result as it comes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from bristle.fleet.cluster import here, opened, rows_of
from bristle.fleet.items import FleetItem, fleet_items
from bristle.fleet.results import FleetResults
from bristle.fleet.rows import WORK
from bristle.fleet.work import Row
from recordings import BadInput, BadParameter, Progress, silent

TellRow = Callable[[Row], None]
"""Told of every result as it comes."""


def _nobody(row: Row) -> None:
    """Tells nobody."""


def run_fleet(
    what: str,
    source: str,
    out: Path,
    *,
    options: Mapping[str, Any] | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    pages: Path | None = None,
    progress: Progress = silent,
    tell: TellRow = _nobody,
) -> list[Row]:
    """Do the same work to every recording set of a folder or a table; returns all rows, old and new.

    what : ``fit``, ``trace``, ``assess`` or ``test``; out : the Parquet table; options : of the work; scheduler :
    address of a Dask scheduler, None for a cluster of this machine; workers : processes of that cluster, None for one
    a core, 0 for this process; pages : folder for a page of each valve; it must be one that all workers share.

    What `out` has already, of the same recordings and options, is not done again. Raises BadInput, and LinkError when
    the scheduler goes away; what came until then is in `out`.
    """
    options = {name: value for name, value in (options or {}).items() if value not in (None, (), {}, "")}
    _check(what, options)
    items = {item.key(what, options): item for item in fleet_items(source, what)}
    with FleetResults(out, what) as results:
        results.keep(items)
        tasks = _tasks(what, items, options, results, pages)
        done = len(items) - len(tasks)
        progress("valves", done, len(items))
        place = nullcontext(None) if workers == 0 or not tasks else opened(scheduler, workers)
        with place as client:
            for row in here(tasks) if client is None else rows_of(client, tasks):
                results.add(row)
                done += 1
                progress("valves", done, len(items))
                tell(row)
        return results.whole()


def _tasks(
    what: str, items: Mapping[str, FleetItem], options: Mapping[str, Any], results: FleetResults, pages: Path | None
) -> dict[str, tuple[Any, ...]]:
    """Arguments of what is still to be done, by key: no settled result, or no page where one is wanted."""
    folder = None if pages is None else str(pages.resolve())
    return {
        key: (what, item, options, key, folder)
        for key, item in items.items()
        if not results.settled(key) or (pages is not None and not _has_page(results.rows[key], pages))
    }


def _has_page(row: Row, pages: Path) -> bool:
    return row["state"] != "done" or (row["page"] is not None and (pages / row["page"]).exists())


def _check(what: str, options: Mapping[str, Any]) -> None:
    if what not in WORK:
        raise BadParameter("what", what, "it cannot be done to a fleet", f"there are {', '.join(WORK)}")
    if what == "test" and "kind" not in options:
        raise BadInput("fleet test", "it is not said which test", "say one, for example step", parameter="kind")
