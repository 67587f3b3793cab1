"""How often `bristle assess` is right on simulated loops that nobody has looked at, in Markdown tables.

    python -m studies.loop_judgement --seeds 8230 8430 --kept 40 --write docs/studies/simulated-loops.md

Which sticky loops count as told by their data is in `sticky_loops`. With `--kept` so many of the seeds are also judged
as historians keep them.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import pairwise
from pathlib import Path

import numpy as np

from identification.loops import (
    CAUSES,
    Assessment,
    ControlLoop,
    SimulatedLoop,
    assess_loop,
    compressed,
    interpolated,
    quantised,
    simulated_loop,
)
from identification.standard_tests import Interval
from studies.sticky_loops import TOLD, hidden_by_positioner, told

VALVES = {"kano": "element of Kano", "he": "element of He", "stem": "stem", "positioned": "stem behind a positioner"}
VERDICTS = ("stiction", "no_stiction", "cannot_tell")
BINS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
KEEPERS: Mapping[str, Callable[[ControlLoop, float], ControlLoop]] = {
    "rounded to": quantised, "dead band, repeated,": compressed, "dead band, interpolated,": interpolated,
}  # fmt: skip
SIGMAS = (0.5, 1.0, 2.0)
"""Steps and dead bands of historians, in standard deviations of the noise."""
HIDDEN = {"nothing": "data show the shape of signals", "shape": "they hide it", "everything": "they hide everything"}


@dataclass(frozen=True)
class Judged:
    """A loop whose cause is known, and what was found. told : as of `sticky_loops`."""

    seed: int
    known: SimulatedLoop
    found: Assessment
    told: tuple[float, float]

    @property
    def masked(self) -> bool:
        """Whether a positioner hides its sticky valve."""
        return hidden_by_positioner(self.known, self.told)

    @property
    def sticky(self) -> bool:
        """Whether the valve sticks by more than two noise sigmas, and no positioner hides it."""
        return self.known.cause == "stiction" and self.known.j > 2 * self.known.noise and not self.masked

    @property
    def hidden(self) -> str:
        """What its data hide."""
        hides = {problem.hides for problem in self.found.problems}
        return "everything" if "everything" in hides else "shape" if "shape" in hides else "nothing"


def judged(seed: int) -> Judged:
    """The loop of a seed as it was recorded."""
    known = simulated_loop(seed)
    stem = known.stem
    valve = {"area": stem.full / 8e4, "span": 80.0} if stem else None
    return Judged(seed, known, assess_loop(known.loop, valve=valve), told(known))


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines) + "\n"


def causes(loops: Sequence[Judged]) -> str:
    """Answers by cause."""
    masked = "stiction that a positioner hides"
    count = Counter((masked if one.masked else one.known.cause, one.found.verdict) for one in loops)
    names = (CAUSES[0], masked, *CAUSES[1:])
    rows = [[cause, *(count[cause, verdict] for verdict in VERDICTS)] for cause in names]
    return table(("cause", *VERDICTS), rows)


def found_by_data(loops: Sequence[Judged]) -> str:
    """How many sticky loops were found, by what their data tell."""
    sticky = [one for one in loops if one.sticky]
    moved = [one for one in sticky if one.known.moves >= 2]
    shown = [one for one in moved if min(one.told) > TOLD]
    parts: dict[str, list[Judged]] = {
        "J above two noise sigmas": sticky,
        "the valve never moved, or went one way only": [one for one in sticky if one.known.moves < 2],
        "it moved, and its true course tells it": shown,
        "it moved, and its true course does not tell it from a linear process": [
            one for one in moved if one.told[0] <= TOLD
        ],
        "it moved, and its true course tells it from that, but not from backlash": [
            one for one in moved if one.told[1] <= TOLD < one.told[0]
        ],
    }
    for hidden, words in HIDDEN.items():
        parts[f"told by the true course; {words}"] = [one for one in shown if one.hidden == hidden]
    for valve in VALVES:
        parts[f"told by the true course; {VALVES[valve]}"] = [one for one in shown if one.known.valve == valve]
    count = {words: Counter(one.found.verdict for one in some) for words, some in parts.items()}
    rows = [[words, len(some), *(count[words][verdict] for verdict in VERDICTS)] for words, some in parts.items()]
    return table(("sticky loops", "loops", *VERDICTS), rows)


def reliability(loops: Sequence[Judged]) -> str:
    """How often loops stick, by the probability that was given."""
    rows = []
    given = [(one, one.found.probability) for one in loops if one.found.probability is not None]
    for low, high in pairwise(BINS):
        some = [(one, p) for one, p in given if low <= p < high or p == high == BINS[-1]]
        if some:
            mean = np.mean([p for _, p in some])
            sticky = sum(one.known.cause == "stiction" for one, _ in some)
            rows.append([f"{low:g} to {high:g}", len(some), f"{mean:.2f}", f"{sticky / len(some):.2f}"])
    return table(("probability", "loops", "its mean", "share that sticks"), rows)


def intervals(loops: Sequence[Judged]) -> str:
    """How many intervals hold S, J and the friction of stems."""
    rows = []
    for valve in ("kano", "he", "stem"):  # behind a positioner OP has no S
        some = [one for one in loops if one.known.cause == "stiction" and one.known.valve == valve and one.found.amount]
        truths: dict[str, Callable[[Judged], tuple[float, Interval]]] = {"S": _s, "J": _j}
        truths |= {"fs": _fs, "fc": _fc} if valve == "stem" else {}
        for name, pair in truths.items():
            pairs = [pair(one) for one in some]
            if pairs:
                rows.append([valve, name, *of_intervals(pairs)])
    return table(("valve", "", "found", *OF_INTERVALS), rows)


OF_INTERVALS = ("intervals that hold it", "median half width", "median error")


def of_intervals(pairs: Sequence[tuple[float, Interval]]) -> list[object]:
    """How many pairs of a truth and its interval there are, and `OF_INTERVALS`."""
    held = sum(one.lower <= true <= one.upper for true, one in pairs)
    width = np.median([(one.upper - one.lower) / 2 / true for true, one in pairs])
    off = np.median([abs(one.value / true - 1) for true, one in pairs])
    return [len(pairs), held, f"{100 * width:.0f} %", f"{100 * off:.0f} %"]


def _s(one: Judged) -> tuple[float, Interval]:
    assert one.found.amount
    return one.known.s, one.found.amount.s


def _j(one: Judged) -> tuple[float, Interval]:
    assert one.found.amount
    return one.known.j, one.found.amount.j


def _fs(one: Judged) -> tuple[float, Interval]:
    assert one.found.forces
    assert one.known.stem
    return one.known.stem.values["lugre.fs"], one.found.forces.fs


def _fc(one: Judged) -> tuple[float, Interval]:
    assert one.found.forces
    assert one.known.stem
    return one.known.stem.values["lugre.fc"], one.found.forces.fc


def kept(known: SimulatedLoop) -> dict[str, ControlLoop]:
    """A loop as historians keep it, by what they do to it."""
    each = {
        f"{words} {sigma:g} sigma": keep(known.loop, sigma * known.noise)
        for words, keep in KEEPERS.items()
        for sigma in SIGMAS
    }
    return {"as recorded": known.loop, **each}


def as_historians_keep(loops: Sequence[Judged]) -> str:
    """Answers by what a historian does to the same loops, and which sticky ones it makes look healthy."""
    count: Counter[tuple[str, str, str]] = Counter()
    healthy = []
    for one in loops:
        found = "sticks, found" if one.found.verdict == "stiction" else "sticks, not found"
        group = found if one.sticky else one.known.cause
        for how, loop in kept(one.known).items():
            verdict = assess_loop(loop).verdict
            count[group, how, verdict] += 1
            if one.sticky and verdict == "no_stiction":
                healthy.append(f"{one.seed} ({how})")
    rows = [
        [how, group, sum(counts), *counts]
        for group in ("sticks, found", "sticks, not found", *CAUSES[1:])
        for how in dict.fromkeys(how for _, how, _ in count)
        if sum(counts := [count[group, how, verdict] for verdict in VERDICTS])
    ]
    head = table(("kept by the historian", "loop, as recorded", "loops", *VERDICTS), rows)
    return f"{head}\nSticky loops called `no_stiction`: {', '.join(healthy) or 'none'}\n"


def misses(loops: Sequence[Judged]) -> str:
    """False answers by seed, and sticky loops that their data tell and that were not found."""
    false = [f"{one.seed} ({one.known.cause})" for one in loops if _false(one)]
    missed = [f"{one.seed} ({one.hidden} hidden)" for one in loops if _missed(one)]
    return f"False: {', '.join(false) or 'none'}\n\nTold and not found: {', '.join(missed) or 'none'}\n"


def _false(one: Judged) -> bool:
    wrong = "no_stiction" if one.sticky else "stiction"
    return one.found.verdict == wrong and (one.sticky or one.known.cause != "stiction")


def _missed(one: Judged) -> bool:
    return one.sticky and one.known.moves >= 2 and min(one.told) > TOLD and one.found.verdict != "stiction"


PARTS = {
    "Answers by cause": causes,
    "What the data tell": found_by_data,
    "Reliability of the probability": reliability,
    "S, J and friction": intervals,
    "Misses": misses,
}


def results(first: int, last: int, kept: int) -> str:
    """All tables."""
    loops = [judged(seed) for seed in range(first, last)]
    parts = [f"### {title}\n\n{part(loops)}" for title, part in PARTS.items()]
    if kept:
        title = f"### The first {kept} loops as historians keep them"
        parts.append(f"{title}\n\n{as_historians_keep(loops[:kept])}")
    return "\n".join([f"## Seeds {first} to {last - 1}, {date.today().isoformat()}\n", *parts])


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", nargs=2, type=int, default=(8230, 8430))
    parser.add_argument("--kept", type=int, default=0)
    parser.add_argument("--write", type=Path, help="take the place of the results of this page")
    given = parser.parse_args()
    show(results(*given.seeds, given.kept), given.write)


def show(found: str, page: Path | None) -> None:
    """Print results, and put them in the place of those of a page."""
    print(found)
    if page:
        words = page.read_text(encoding="utf-8").partition("## Seeds")[0]
        page.write_text(words + found, encoding="utf-8")


if __name__ == "__main__":
    main()
