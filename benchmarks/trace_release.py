"""The table of a release of `trace`: cases that a seed draws, run from one commit, and the page that tells of them.

`python -m benchmarks.trace --release --seed S` runs what is left of it, `--minutes M` until so much processor time was
spent. Cases are in an order drawn by the seed in which every kind has its turn, so that a table that was not finished
is a fair sample of every kind; `--parts controls` runs what lacks nothing first. Finished cases are in
`benchmarks/releases`: a table goes on in any clone with history. A further seed, or a commit that changes what is
measured, begins a table of its own; the page keeps those of other seeds.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.plants.cases import Case
from benchmarks.plants.effects import OTHER, OUTSIDE, SAME
from benchmarks.trace_report import Row, scored
from identification import trace_settings as settings

PAGE = Path("docs/studies/trace-release.md")
ROWS = Path("benchmarks/releases")
"""The finished cases, a file for every seed and commit."""
MEASURED = ("identification", "recordings", "simulator", "benchmarks/plants", "benchmarks/trace*.py", "constraints.txt")
"""What says how a case comes out."""
LEFT_OUT = ("identification/report", "benchmarks/plants/strengths.json")
"""What does not: pages, and the strengths that a release itself had to find."""
STRENGTHS = (1.5, 3.0, 6.0, 12.0)
VALVES, CONTROLS, OUTSIDERS, RIGS = 3, 200, 20, 20
"""Valves of every effect and strength; sets without an effect, and with one that no catalogue has; complete rigs."""
BUDGET = 240.0
"""Seconds of the clock that a trace may take: on one core as much as `bristle trace` takes on two."""
SLOW = ((100.0, "both"), (50.0, "both"), (100.0, "position"), (50.0, "position"))
"""Rates [Hz], and whether both channels or the position alone are that slow."""
HEAD = f"""# A table of tracing from one commit

`python -m benchmarks.trace --release --seed S` draws valves that nothing was developed on, runs all cases from one
commit and writes this page. It goes on where it stopped. In every row *n* says how many of the cases were run; their
order is drawn, so that those that were run are a fair sample. *Right* is the verdict or its class, `none` without an
effect, `unlisted` outside the catalogue. [The study](tracing.md) says how the plants are made. *The truth gains* says
of a miss what the plant's own effects, fitted on from its own parameters, gain over the base model: with less than
`MIN_GAIN` ({settings.MIN_GAIN:.0f}) they would not have been accepted, either. *Passes* are the nodes that the filter
went over in a trace, over the samples that were fitted.
"""

Work = tuple[str, Case]
"""A part of the study and a case of it."""
Kind = tuple[str, ...]
"""What the cases of a row of the table have in common."""


def drawn(seed: int, pairs: Sequence[tuple[str, str]]) -> list[Work]:
    """All cases of a seed, in an order in which every kind has its turn. pairs : of effects."""
    rng = np.random.default_rng([seed, 22])
    kinds = defaultdict[Kind, list[Work]](list)
    for part, case in _all(rng, pairs):
        kinds[kind_of(part, case)].append((part, case))
    queues = [[some[i] for i in rng.permutation(len(some))] for some in kinds.values()]
    turns = [list(filter(None, turn)) for turn in itertools.zip_longest(*queues)]
    return [turn[i] for turn in turns for i in rng.permutation(len(turn))]


def kind_of(part: str, case: Case) -> Kind:
    """The row of the table that a case belongs to."""
    if part == "single":
        return ("an effect" if case.form == "same" else "another form", f"{case.strength:g}")
    if part == "slow":
        return ("slow sampling", f"{case.rate:g} Hz {case.slow}")
    if part == "controls":
        return ("a rig, nothing missing" if case.rig else "nothing missing", "")
    return ({"outside": "outside the catalogue", "pairs": "pairs"}[part], f"{case.strength:g}")


def _all(rng: np.random.Generator, pairs: Sequence[tuple[str, str]]) -> Iterator[Work]:
    def valve() -> int:
        return int(rng.integers(10_000, 1_000_000))

    valves = [valve() for _ in range(VALVES)]
    yield from (("single", Case(v, (e,), s)) for v in valves for e in SAME for s in STRENGTHS)
    yield from (("single", Case(valves[0], (e,), 6.0, "other")) for e in SAME if e in OTHER)
    yield from (("slow", Case(valves[1], (e,), 6.0, "same", *slow)) for e in SAME for slow in SLOW)
    yield from (("pairs", Case(v, pair, 6.0)) for v in valves[:2] for pair in pairs)
    outside = itertools.cycle(OUTSIDE)
    yield from (("outside", Case(valves[i % VALVES], (next(outside),), 6.0)) for i in range(OUTSIDERS))
    for i in range(CONTROLS + RIGS):
        rate = float(rng.choice([500.0, 500.0, 250.0, 100.0]))
        slow = "position" if rate < 500.0 and rng.random() < 0.5 and i < CONTROLS else "both"
        noise = float(rng.choice([0.5, 1.0, 1.0, 2.0]))
        yield "controls", Case(valve(), rate=rate, slow=slow, noise=noise, rig=i >= CONTROLS)


def good(row: Row) -> bool:
    """Whether a case came out as it should."""
    return scored(row) == ("unlisted" if row["part"] == "outside" else "right")


def table(rows: Sequence[Row], work: Sequence[Work]) -> list[str]:
    """The rows of the page: what was run of each kind, and what came out."""
    wanted, found = defaultdict[Kind, int](int), defaultdict[Kind, list[Row]](list)
    cases = {(part, case.name): kind_of(part, case) for part, case in work}
    for kind in cases.values():
        wanted[kind] += 1
    for row in rows:
        found[cases[row["part"], row["name"]]].append(row)
    lines = [
        "| cases | strength or sampling | n of | right | wrong name | others |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for kind, many in wanted.items():
        mine = found[kind]
        said = [scored(row) for row in mine if not good(row)]
        wrong = said.count("wrong")
        counts = f"{len(mine)} of {many}", len(mine) - len(said), wrong, len(said) - wrong
        lines.append("| " + " | ".join(map(str, (*kind, *counts))) + " |")
    return lines


def misses(rows: Sequence[Row]) -> list[str]:
    """Every case that did not come out as it should, one by one, with what its truth gains."""
    return [f"- {row['part']} {row['name']}: {row['verdict']}{_remark(row)}" for row in rows if not good(row)]


def _remark(row: Row) -> str:
    said = [row["why"]] if row.get("why") else []
    if np.isfinite(row.get("gain_of_truth", np.nan)):
        said.append(f"the truth gains {row['gain_of_truth']:.0f}")
    return f" ({', '.join(said)})" if said else ""


def section(seed: int, head: str, rows: Sequence[Row], work: Sequence[Work]) -> str:
    """The part of the page that one seed has."""
    about = f"Commit {head}; {'; '.join(dict.fromkeys(row['where_run'] for row in rows)) or 'nothing was run'}."
    for what, some in (("A trace", [r for r in rows if not r["rig"]]), ("One of a rig", [r for r in rows if r["rig"]])):
        about += _costs(what, some) if some else ""
    if rows:
        late = sum(not row.get("complete", True) for row in rows)
        about += f" The budget of {BUDGET:.0f} s of the clock was over in {late} of {len(rows)}." if late else ""
    missed = misses(rows)
    listed = ["The misses:", "", *missed] if missed else ["No misses."]
    return "\n".join([f"## Seed {seed}", "", about, "", *table(rows, work), "", *listed, ""])


def _costs(what: str, rows: Sequence[Row]) -> str:
    """What some traces took. Predicted forces of a rig take no passes of the estimator that counts them."""
    seconds, passes = ([row[item] for row in rows] for item in ("processor", "passes"))
    long, memory = np.quantile(seconds, 0.9), max(row["peak_MB"] for row in rows)
    counted = f", {np.median(passes):.0f} passes (most {max(passes):.0f})" if any(passes) else ""
    return (
        f" {what} took {np.median(seconds):.0f} s of processor time (median; nine in ten {long:.0f}, most"
        f" {max(seconds):.0f}){counted} and up to {memory:.0f} MB."
    )


def written(page: str, seed: int, text: str) -> str:
    """The page with the part of a seed in it, in the place of an earlier one of the same seed."""
    _, *parts = page.split("\n## Seed ")
    kept = [part for part in parts if not part.startswith(f"{seed}\n")]
    return "\n## Seed ".join([HEAD.rstrip() + "\n", *kept, text.removeprefix("## Seed ")])


def results_of(seed: int, head: str) -> Path:
    """Where the finished cases of a seed and a commit are kept; those of a tree with changes are no release."""
    return (Path("build") if " " in head else ROWS) / f"{seed}-{head[:12]}.jsonl"
