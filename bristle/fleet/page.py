"""The page of a fleet, from its rows."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from bristle.fleet.estimates import FleetQuantity
from bristle.fleet.ranking import RATE, RankedValve, TypeOfValve, ranked, types_of_valves
from bristle.fleet.work import Row
from identification.population import Outlyingness
from identification.report import Cell, Distribution, FleetSection, FleetTable, write_fleet_report
from recordings import ReportOpening

SHOWN = 25
"""Valves of a ranking."""

NARROWER = 0.9
"""Pooled intervals are shown where they are shorter than this share of the valve's own."""


def write_fleet_page(path: Path, what: str, rows: Sequence[Row], pages: Path | None, rate: float = RATE) -> None:
    """Write the page. pages : folder with the valves' own pages; rate : false-discovery rate of outliers.

    Raises BadInput when it cannot be written.
    """
    link = _links(path, pages)
    valves, types = ranked(rows), types_of_valves(rows, rate)
    sections = [
        _overview(what, rows, valves),
        *_friction(valves, link),
        *_spring(valves, link),
        *_stiction(valves, link),
        *_evidence(valves, link),
        *(section for one in types for section in _type(one, link, rate)),
        _all(rows, link),
    ]
    write_fleet_report(path, f"Fleet {what}: {len(valves)} valves", _opening(rows, types, rate), sections)


def _opening(rows: Sequence[Row], types: Sequence[TypeOfValve], rate: float) -> ReportOpening:
    """What to do first: look at what stands out, or record again what gave no answer."""
    odd = {
        str(one.rows[k]["valve"])
        for one in types
        for found in one.outliers.values()
        for k in np.flatnonzero(found.told).tolist()
    }
    open_ = sum(row["state"] != "done" for row in rows)
    sure = f"{len(rows) - open_} of {len(rows)} recording sets gave an answer; false-discovery rate {100 * rate:.0f} %"
    if odd:
        why = f"{len(odd)} valves stand out from the others of their type"
        return ReportOpening(
            "watch", why, sure, f"look at {', '.join(sorted(odd)[:5])}{' and others' if len(odd) > 5 else ''}"
        )
    if open_:
        return ReportOpening(
            "watch", f"{open_} recording sets gave no answer", sure, "see why of each, and record again"
        )
    return ReportOpening(
        "good", "no valve stands out from the others of its type", sure, "nothing; look again in a year"
    )


RowLink = Callable[[Row], Cell]


def _links(path: Path, pages: Path | None) -> RowLink:
    """The tag of a row's valve, leading to its page where there is one."""

    def link(row: Row) -> Cell:
        if pages is None or not row.get("page"):
            return Cell(str(row["valve"]))
        return Cell(str(row["valve"]), Path(os.path.relpath(pages / row["page"], path.parent)).as_posix())

    return link


def _overview(what: str, rows: Sequence[Row], valves: Sequence[RankedValve]) -> FleetSection:
    states = Counter(str(row["state"]) for row in rows)
    told = ", ".join(f"{count} {state}" for state, count in sorted(states.items()))
    sentences = [f"{len(rows)} recording sets of {len(valves)} valves: {told}."]
    verdicts = Counter(str(row["verdict"]) for row in rows if row.get("verdict"))
    if verdicts:
        sentences.append("Verdicts: " + ", ".join(f"{word} {count}" for word, count in verdicts.most_common()) + ".")
    return FleetSection(f"Fleet {what}", sentences)


def _friction(valves: Sequence[RankedValve], link: RowLink) -> Iterator[FleetSection]:
    found = [(one, one.friction) for one in valves if one.friction is not None]
    found.sort(key=lambda pair: -pair[1].slope / pair[1].std)
    rows = [
        [link(one.last), Cell(f"{_percent(t.slope):+.1f} %"), Cell(_interval(t.slope, t.std)), Cell(f"{t.p:.2g}")]
        for one, t in found[:SHOWN]
    ]
    if rows:
        head = ("valve", "friction a year", "90 % interval", "p of no trend")
        said = "Coulomb friction over the dates of the recordings; the surest growth first."
        yield FleetSection("Friction trend", [said], FleetTable(head, rows))


def _spring(valves: Sequence[RankedValve], link: RowLink) -> Iterator[FleetSection]:
    found = [(one, one.spring) for one in valves if one.spring is not None]
    found.sort(key=lambda pair: pair[1].p)
    rows = [
        [link(one.last), Cell(f"{_percent(c.value):+.2f} %"), Cell(_interval(c.value, c.std)), Cell(f"{c.p:.2g}")]
        for one, c in found[:SHOWN]
    ]
    if rows:
        head = ("valve", "spring rate", "90 % interval", "p of no change")
        said = "Spring rate of the last recording against the first; the surest change first."
        yield FleetSection("Change of spring rate", [said], FleetTable(head, rows))


def _evidence(valves: Sequence[RankedValve], link: RowLink) -> Iterator[FleetSection]:
    """Valves without an answer first, then by the parameter that is known worst."""
    ordered = sorted(valves, key=_doubt, reverse=True)
    rows = []
    for one in ordered[:SHOWN]:
        name, error = one.weakest or ("", math.nan)
        known = "" if not name else "not known" if math.isinf(error) else f"± {100 * error:.2g} %"
        rows.append([link(one.last), Cell(str(one.last["state"])), Cell(name), Cell(known), Cell(one.last["sentence"])])
    head = ("valve", "state", "known worst", "standard deviation", "what was found")
    yield FleetSection("Weakest evidence", ["Where a better recording helps most."], FleetTable(head, rows))


def _doubt(one: RankedValve) -> tuple[float, float]:
    return (one.last["state"] != "done", one.weakest[1] if one.weakest else 0.0)


def _stiction(valves: Sequence[RankedValve], link: RowLink) -> Iterator[FleetSection]:
    found = [one for one in valves if one.last.get("probability") is not None]
    found.sort(key=lambda one: -one.last["probability"])
    rows = [
        [link(one.last), Cell(f"{one.last['probability']:.2f}"), Cell(str(one.last["verdict"]))]
        for one in found[:SHOWN]
    ]
    if rows:
        table = FleetTable(("loop", "probability of stiction", "verdict"), rows)
        yield FleetSection("Stiction", ["The most probable first."], table)


def _type(one: TypeOfValve, link: RowLink, rate: float) -> Iterator[FleetSection]:
    name = f"type {one.kind}" if one.kind else "all types"
    drawn = [
        Distribution(q.name, q.values, one.outliers[q.name].told, q.logarithmic)
        for q in one.quantities
        if np.isfinite(q.values).sum() > 1
    ]
    odd = [
        [link(one.rows[k]), *_against(q, o, k)]
        for q in one.quantities
        for o in [one.outliers[q.name]]
        for k in np.flatnonzero(o.told).tolist()
    ]  # fmt: skip
    said = (
        f"Outliers against the distribution of these {len(one.rows)} valves. Of those that are told for a quantity, "
        f"at most {100 * rate:.0f} % are expected to be sound (false-discovery rate)."
    )
    head = ("valve", "quantity", "value", "middle", "spreads away", "q")
    yield FleetSection(f"Distributions, {name}", [said], FleetTable(head, odd) if odd else None, drawn)
    yield from _pooling(one, name, link)


def _against(quantity: FleetQuantity, found: Outlyingness, place: int) -> Iterator[Cell]:
    """A valve against the others: quantity, its value, the middle of all, how far away in spreads, and q."""
    yield Cell(quantity.name)
    yield Cell(f"{quantity.values[place]:.4g}")
    yield Cell(f"{quantity.back(found.middle):.4g}")
    yield Cell(f"{found.score[place]:+.1f}")
    yield Cell(f"{found.q[place]:.2g}")


def _pooling(one: TypeOfValve, name: str, link: RowLink) -> Iterator[FleetSection]:
    """Pooled estimates that are narrower than the valve's own, and a prior for the next valve of the type."""
    rows, priors = [], []
    for q in one.quantities:
        if q.name not in one.pooled:
            continue
        together = one.pooled[q.name]
        values, errors = q.scaled
        new = q.back(together.new_mean)
        width = together.new_std * new if q.logarithmic else together.new_std
        priors.append(f"{q.name}={new:.4g}+-{width:.2g}")
        for k in np.flatnonzero(together.std < NARROWER * errors).tolist():
            own, pooled = ((values[k], errors[k]), (together.mean[k], together.std[k]))
            cells = [
                f"{q.back(m):.4g} ({q.back(m - 1.645 * s):.4g} to {q.back(m + 1.645 * s):.4g})"
                for m, s in (own, pooled)
            ]
            rows.append([link(one.rows[k]), Cell(q.name), *map(Cell, cells)])
    if priors:
        said = [
            "A hierarchical model of the valves of this type: where its interval is narrower than the valve's own, "
            "what the others say of this valve is worth more than its own recording.",
            f"For the next valve of this type, as priors: {', '.join(priors)}",
        ]
        head = ("valve", "quantity", "own, 90 %", "pooled, 90 %")
        yield FleetSection(f"Pooled, {name}", said, FleetTable(head, rows[: 4 * SHOWN]) if rows else None)


def _all(rows: Sequence[Row], link: RowLink) -> FleetSection:
    cells = [[link(row), *(Cell(str(row[n] or "")) for n in ("type", "date", "state", "sentence"))] for row in rows]
    return FleetSection("All recordings", (), FleetTable(("valve", "type", "date", "state", "what was found"), cells))


def _percent(logarithm: float) -> float:
    return 100.0 * math.expm1(min(logarithm, 50.0))


def _interval(value: float, std: float) -> str:
    return f"{_percent(value - 1.645 * std):+.1f} to {_percent(value + 1.645 * std):+.1f} %"
