"""How a table of `trace` stands beside its goals: shares with their intervals, and what its traces cost.

    python -m benchmarks.release_goals 22017          the finished cases of that seed, of every commit it was run at

Reads `benchmarks/releases`; nothing is run. An interval is that of Clopper and Pearson, 95 %: the cases of a table are
drawn, and so are those of every kind that were run. A goal is *met* or *missed* if the whole interval says so, and
*open* where the cases are too few to tell.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

from benchmarks.trace import known_rows
from benchmarks.trace_release import ROWS, good
from benchmarks.trace_report import Row, scored
from identification import trace_settings as settings
from recordings import BadInput
from studies import drawing

SHOWS = 2.5
"""Noises that an effect leaves at least to be asked for: some leave less at the largest strength that makes sense."""
UNSEEN = 1.1
"""Free-run error of a base model, in those of the plant itself, up to which hardly anything shows of what it lacks."""
LONG = 45_000
"""Samples that are fitted of the recordings for which times and memory are asked."""


@dataclass(frozen=True)
class Goal:
    """A share that is asked for. of : the cases that count; share : at least, or at most where `most` is set [%]."""

    what: str
    of: Callable[[Row], bool]
    share: float
    most: bool = False

    def cells(self, rows: Sequence[Row]) -> tuple[str, ...]:
        """Its row of the table; of too few cases it says so."""
        some = list(filter(self.of, rows))
        asked = f"{'at most' if self.most else 'at least'} {self.share:g} %"
        if not some:
            return self.what, asked, "0 of 0", "", "not run"
        hits = sum(scored(row) == "wrong" if self.most else good(row) for row in some)
        interval = binomtest(hits, len(some)).proportion_ci()
        low, high = 100 * interval.low, 100 * interval.high
        share = f"{100 * hits / len(some):.3g} % ({low:.0f} to {high:.0f})"
        return self.what, asked, f"{hits} of {len(some)}", share, self._verdict(low, high)

    def _verdict(self, low: float, high: float) -> str:
        under, over = high < self.share, low > self.share
        met, missed = (under, over) if self.most else (over, under)
        return "met" if met else "missed" if missed else "open"


def _one(form: str) -> Callable[[Row], bool]:
    alone = _part("single")
    return lambda row: alone(row) and row["strength"] >= 3 and row["form"] == form


def _lacks_nothing(*, rig: bool) -> Callable[[Row], bool]:
    return lambda row: row["part"] == "controls" and row["rig"] == rig


def _part(part: str) -> Callable[[Row], bool]:
    return lambda row: row["part"] == part and not is_weak(row)


def is_weak(row: Row) -> bool:
    """Whether an effect of a case leaves too little to be asked for, however strong it is."""
    return bool(row["effects"]) and row["strength"] >= 3 and row["reached"] < SHOWS


GOALS = (
    Goal("one effect at strength 3 and more, 500 Hz: its name or class", _one("same"), 95),
    Goal("the same in another form than the catalogue's", _one("other"), 95),
    Goal("the same at 50 and 100 Hz, strength 6", _part("slow"), 95),
    Goal("pairs: both", _part("pairs"), 85),
    Goal("outside the catalogue: `unlisted`", _part("outside"), 95),
    Goal("nothing missing: `none`", _lacks_nothing(rig=False), 99),
    Goal("nothing missing, a rig: `none`", _lacks_nothing(rig=True), 99),
    Goal("a wrong name, where something is missing", lambda row: bool(row["effects"]), 1, most=True),
    Goal("a wrong name, where nothing is", lambda row: not row["effects"], 1, most=True),
)


def shares(rows: Sequence[Row]) -> list[str]:
    """The table of goals that are shares of cases."""
    head = "cases", "asked", "came out so", "share, 95 % interval", "goal"
    return drawing.rows_of(head, [goal.cells(rows) for goal in GOALS])


def weak(rows: Sequence[Row]) -> str:
    """How many cases have an effect that hardly shows, and how many misses nothing could have named."""
    asked = [row for row in rows if row["effects"] and row["strength"] >= 3]
    missed = [row for row in rows if not good(row) and np.isfinite(row.get("gain_of_truth", np.nan))]
    hidden = sum(row["gain_of_truth"] < settings.MIN_GAIN for row in missed)
    return (
        f"Of {len(asked)} cases with an effect at strength 3 and more {sum(map(is_weak, asked))} leave less than"
        f" {SHOWS:g} noises at the largest strength that makes sense: they count as wrong names only. Of {len(missed)}"
        f" misses of what the catalogue has, {hidden} have a truth that gains less than `MIN_GAIN`"
        f" ({settings.MIN_GAIN:.0f}): nothing could have named them."
    )


def unseen(rows: Sequence[Row]) -> str:
    """How often nothing was found to be missing where something is, and how often that hardly shows in free runs: the
    recorded force is noisy, and so the plant itself does not run as the position was recorded.
    """
    said = [row for row in rows if row["effects"] and row["verdict"] == "none" and not row["rig"]]
    hidden = sum(row["before"] < UNSEEN * row["true"] for row in said)
    return (
        f"Of {len(said)} answers `none` where something is missing, {hidden} have a free-run error of the base model,"
        f" on the held-out recording, of less than {UNSEEN:g} times that of the plant itself under the recorded, noisy"
        " force."
    )


def costs(rows: Sequence[Row]) -> list[str]:
    """What traces of long recordings cost, beside what they may; rigs' predicted forces are another matter."""
    some = [row for row in rows if row["samples"] >= LONG and not row["rig"]]
    none, lacking = ([row for row in some if bool(row["effects"]) == lacks] for lacks in (False, True))
    asked = (
        ("processor time where something is missing, median", lacking, "processor", 0.5, 40.0, "s"),
        ("processor time where something is missing, nine in ten", lacking, "processor", 0.9, 80.0, "s"),
        ("processor time where nothing is missing, median", none, "processor", 0.5, 24.0, "s"),
        ("passes over all samples, most", some, "passes", 1.0, 600.0, ""),
        ("memory of the process, most", some, "peak_MB", 1.0, 1000.0, "MB"),
    )
    found = []
    for what, mine, item, level, goal, unit in asked:
        if mine:
            value = float(np.quantile([row[item] for row in mine], level))
            met = "met" if value <= goal else "missed"
            found.append((what, str(len(mine)), f"{goal:g} {unit}".strip(), f"{value:,.0f} {unit}".strip(), met))
    return drawing.rows_of(("cost of a trace", "cases", "asked", "measured", "goal"), found)


def rows_of(seed: int) -> list[Row]:
    """The finished cases of a seed. Raises BadInput where there are none."""
    rows = [row for path in sorted(ROWS.glob(f"{seed}-*.jsonl")) for row in known_rows(path)]
    if not rows:
        remedy = f"python -m benchmarks.trace --release --seed {seed}"
        raise BadInput(f"seed {seed}", f"no finished cases in {ROWS}", remedy)
    return rows


def main() -> None:
    """Print both tables of a seed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seed", type=int, help="of the table")
    try:
        rows = rows_of(parser.parse_args().seed)
    except BadInput as refusal:
        parser.error(str(refusal))
    print(f"{len(rows)} cases.", "", *shares(rows), "", weak(rows), "", unseen(rows), "", *costs(rows), sep="\n")


if __name__ == "__main__":
    main()
