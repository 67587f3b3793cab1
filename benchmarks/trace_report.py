"""The tables of `benchmarks.trace`: what was right, what was taken for what, errors, times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

PARTS = ("single", "controls", "outside", "pairs", "slow")
ABSENT = ("none", "unlisted")
GOAL = {"single": "95 % right, at most 1 % wrong", "controls": "99 % none", "outside": "95 % unlisted",
        "pairs": "85 % both", "slow": "85 % right"}  # fmt: skip

Row = dict[str, Any]
"""A finished case, a line of the results file."""


def scored(row: Row) -> str:
    """right, wrong, the verdict that names nothing, or for a pair one: the verdict is one of them."""
    verdict, truth = str(row["verdict"]), {*row["effects"]}
    if verdict in (*ABSENT, "failed"):
        return "right" if verdict == "none" and not truth else verdict
    first = {verdict, *row["same_class"]}
    if row["part"] == "pairs" and first & truth:
        return "right" if truth <= first | {*row["added"]} else "one"
    return "right" if first & truth else "wrong"


def report(rows: Sequence[Row]) -> None:
    """All tables of all parts that have rows."""
    for part in PARTS:
        mine = [row for row in rows if row["part"] == part]
        if not mine:
            continue
        print(f"\n{part}: {len(mine)} cases; goal {GOAL[part]}")
        hits(mine, part)
        strong = [row for row in mine if row["effects"] and row["reached"] >= 2.5]
        if 0 < len(strong) < len(mine):
            print(f"  of those that leave 2.5 noises or more: {shares(strong)}")
        confusion(mine)
        for row in mine:
            if scored(row) in ("wrong", "failed"):
                print(f"  {scored(row)}: {row['name']} -> {row['verdict']} {row.get('why', '')}")
    if rows:
        errors(rows)
        costs(rows)


def hits(rows: Sequence[Row], part: str) -> None:
    """Shares of each judgement, in all and by what was varied."""
    good = "unlisted" if part == "outside" else "right"
    print(f"  all: {shares(rows)}")
    if part == "controls":
        chance(rows)
    else:
        extra = sum(bool({*row["added"]} - {*row["effects"], *row["same_class"], row["verdict"]}) for row in rows)
        sizes = [len({*row["same_class"], row["verdict"]}) for row in rows if scored(row) == "right"]
        print(f"  with a further name besides: {extra}; mean size of a right class: {np.mean(sizes or [0]):.1f}")
    for key in ("strength", "form", "rate", "slow", "noise", "valve"):
        values = sorted({row[key] for row in rows})
        if len(values) > 1 and not (key == "valve" and len(values) > 12):
            groups = {v: [row for row in rows if row[key] == v] for v in values}
            print(f"  {good} by {key}: " + ", ".join(f"{v}: {tally(g, good)}" for v, g in groups.items()))


def chance(rows: Sequence[Row]) -> None:
    """What candidates gain where nothing is missing: the most in each set, and the least p-value of those held out."""
    tried = [row["tried"] for row in rows if row.get("tried")]
    if not tried:
        return
    print(f"  candidates refitted in {len(tried)} of {len(rows)} sets; the best of each: median, 90 %, most")
    figures = {
        "fitted gain": [max(gain for _, gain, _, _ in some) for some in tried],
        "held-out gain": [max(held for _, _, held, _ in some) for some in tried],
        "-log10 p": [-np.log10(min(p for _, _, _, p in some)) for some in tried],
    }
    for name, best in figures.items():
        print(f"  {name}: " + ", ".join(f"{value:.1f}" for value in np.quantile(best, (0.5, 0.9, 1.0))))


def tally(rows: Sequence[Row], good: str) -> str:
    """How many of how many."""
    return f"{sum(scored(row) == good for row in rows)}/{len(rows)}"


def shares(rows: Sequence[Row]) -> str:
    """Every judgement with its share."""
    counts = Counter(scored(row) for row in rows)
    return ", ".join(f"{what} {n} ({100 * n / len(rows):.1f} %)" for what, n in counts.most_common())


def confusion(rows: Sequence[Row]) -> None:
    """Truths down, verdicts across; the columns are numbered, with the key underneath."""
    verdicts = sorted({row["verdict"] for row in rows}, key=lambda v: (v in (*ABSENT, "failed"), v))
    print(f"  {'':42}" + "".join(f"{i:4}" for i in range(1, len(verdicts) + 1)) + "   in class")
    for truth in sorted({tuple(row["effects"]) for row in rows}):
        mine = [row for row in rows if tuple(row["effects"]) == truth]
        counts = Counter(row["verdict"] for row in mine)
        inside = sum(scored(row) == "right" and row["verdict"] not in (*truth, "none") for row in mine)
        print(
            f"  {'+'.join(truth) or 'nothing':42}" + "".join(f"{counts[v] or '.':>4}" for v in verdicts) + f"{inside:7}"
        )
    print("  " + ", ".join(f"{i} {v}" for i, v in enumerate(verdicts, 1)))


def errors(rows: Sequence[Row]) -> None:
    """Held-out error before and after tracing, related to the true model's; there is none outside the catalogue."""
    print("\nheld-out error related to the true model's: median, 90 %, share within 1.1")
    for part in PARTS:
        if part == "outside":
            continue
        mine = [row for row in rows if row["part"] == part and row.get("after") and row.get("before")]
        for label, some in ((part, mine), (f"{part} where right", [row for row in mine if scored(row) == "right"])):
            for when in ("before", "after") if some else ():
                ratio = np.array([row[when] / row["true"] for row in some])
                within = 100 * np.mean(ratio <= 1.1)
                print(f"  {label}, {when}: {np.median(ratio):.2f}, {np.quantile(ratio, 0.9):.2f}, {within:.0f} %")


def costs(rows: Sequence[Row]) -> None:
    """Times and memory."""
    print(f"\na trace, {np.median([row['samples'] for row in rows]):.0f} samples fitted: median, 90 %, longest")
    for key, what in (("seconds", "clock [s]"), ("processor", "processor [s]"), ("passes", "passes over all samples"),
                      ("peak_MB", "peak memory [MB]")):  # fmt: skip
        values = [row[key] for row in rows if key in row] or [np.nan]
        print(f"  {what}: {np.median(values):.1f}, {np.quantile(values, 0.9):.1f}, {max(values):.1f}")
