"""How often `bristle assess` is right on simulated loops that nobody has looked at, in Markdown tables.

    python -m studies.loop_judgement --seeds 8200 8400 --kept 40 --write docs/studies/simulated-loops.md

A sticky loop counts as told by its data when the true course of the valve, which no method has, explains PV so much
better than a linear process of high order, and than the best backlash, that twice the logarithm of the likelihoods
differs by more than `TOLD`: odds of 20,000 to 1. With `--kept` so many of the seeds are also judged as historians keep
them.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import pairwise
from pathlib import Path

import numpy as np

from identification.loops import (
    CAUSES,
    HOW,
    Assessment,
    SimulatedLoop,
    as_kept,
    assess_loop,
    compressed,
    simulated_loop,
    told_by_place,
)
from identification.standard_tests import Interval

TOLD = 20.0
VERDICTS = ("stiction", "no_stiction", "cannot_tell")
BINS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
HIDDEN = {"nothing": "data show the shape of signals", "shape": "they hide it", "everything": "they hide everything"}


@dataclass(frozen=True)
class Judged:
    """A loop whose cause is known, and what was found. told : as in the head of this file, for sticky valves."""

    seed: int
    known: SimulatedLoop
    found: Assessment
    told: tuple[float, float]

    @property
    def sticky(self) -> bool:
        """Whether the valve sticks by more than two noise sigmas."""
        return self.known.cause == "stiction" and self.known.j > 2 * self.known.noise

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
    told = told_by_place(known.loop, known.place) if known.cause == "stiction" else (0.0, 0.0)
    return Judged(seed, known, assess_loop(known.loop, valve=valve), told)


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines) + "\n"


def causes(loops: Sequence[Judged]) -> str:
    """Answers by cause."""
    count = Counter((one.known.cause, one.found.verdict) for one in loops)
    rows = [[cause, *(count[cause, verdict] for verdict in VERDICTS)] for cause in CAUSES]
    return table(("cause", *VERDICTS), rows)


def found_by_data(loops: Sequence[Judged]) -> str:
    """How many sticky loops were found, by what their data tell."""
    sticky = [one for one in loops if one.sticky]
    moved = [one for one in sticky if one.known.moves >= 2]
    told = [one for one in moved if min(one.told) > TOLD]
    parts: dict[str, list[Judged]] = {
        "J above two noise sigmas": sticky,
        "the valve never moved, or went one way only": [one for one in sticky if one.known.moves < 2],
        "it moved, and its true course tells it": told,
        "it moved, and its true course does not tell it from a linear process": [
            one for one in moved if one.told[0] <= TOLD
        ],
        "it moved, and its true course tells it from that, but not from backlash": [
            one for one in moved if one.told[1] <= TOLD < one.told[0]
        ],
    }
    for hidden, words in HIDDEN.items():
        parts[f"told by the true course; {words}"] = [one for one in told if one.hidden == hidden]
    for valve in ("kano", "he", "stem"):
        parts[f"told by the true course; valve: {valve}"] = [one for one in told if one.known.valve == valve]
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
    for valve in ("kano", "he", "stem"):
        some = [one for one in loops if one.known.cause == "stiction" and one.known.valve == valve and one.found.amount]
        truths: dict[str, Callable[[Judged], tuple[float, Interval]]] = {"S": _s, "J": _j}
        truths |= {"fs": _fs, "fc": _fc} if valve == "stem" else {}
        for name, pair in truths.items():
            pairs = [pair(one) for one in some]
            if not pairs:
                continue
            held = sum(one.lower <= true <= one.upper for true, one in pairs)
            width = np.median([(one.upper - one.lower) / 2 / true for true, one in pairs])
            off = np.median([abs(one.value / true - 1) for true, one in pairs])
            rows.append([valve, name, len(pairs), held, f"{100 * width:.0f} %", f"{100 * off:.0f} %"])
    return table(("valve", "", "found", "intervals that hold it", "median half width", "median error"), rows)


def joint(loops: Sequence[Judged]) -> str:
    """How many joint posteriors of stem and process hold the truth, of each quantity."""
    found = [(one, one.found.joint, one.known.stem) for one in loops if one.known.cause == "stiction"]
    given = [(one, posterior, stem) for one, posterior, stem in found if stem and posterior and not posterior.refused]
    refused = sum(posterior.refused is not None for _, posterior, stem in found if stem and posterior)
    held: Counter[str] = Counter()
    for one, posterior, stem in given:
        truth = {"fs_N": stem.values["lugre.fs"], "fc_N": stem.values["lugre.fc"], "process_gain": one.known.gain}
        held.update(name for name, part in posterior.values.items() if part.lower <= truth[name] <= part.upper)
    words = ", ".join(f"{name} {held[name]}" for name in ("fs_N", "fc_N", "process_gain"))
    return f"Joint posteriors of stems: {len(given)} given, {refused} refused; they hold: {words}\n"


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


def as_historians_keep(seeds: range) -> str:
    """Answers by what a historian does to the same loops."""
    count: Counter[tuple[str, bool, str]] = Counter()
    for seed in seeds:
        known = simulated_loop(seed)
        kept = {how: as_kept(known.loop, seed, how)[0] for how in HOW}
        kept["dead band of one noise sigma"] = compressed(known.loop, known.noise)
        for how, loop in kept.items():
            count[how, known.cause == "stiction", assess_loop(loop).verdict] += 1
    rows = [
        [how, "stiction" if sticky else "another", *(count[how, sticky, verdict] for verdict in VERDICTS)]
        for how in (*HOW, "dead band of one noise sigma")
        for sticky in (True, False)
    ]
    return table(("as kept", "cause", *VERDICTS), rows)


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
    "Valve and process together": joint,
    "Misses": misses,
}


def results(first: int, last: int, kept: int) -> str:
    """All tables."""
    loops = [judged(seed) for seed in range(first, last)]
    parts = [f"### {title}\n\n{part(loops)}" for title, part in PARTS.items()]
    if kept:
        title = f"### The first {kept} loops as historians keep them"
        parts.append(f"{title}\n\n{as_historians_keep(range(first, first + kept))}")
    return "\n".join([f"## Seeds {first} to {last - 1}, {date.today().isoformat()}\n", *parts])


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", nargs=2, type=int, default=(8200, 8240))
    parser.add_argument("--kept", type=int, default=0)
    parser.add_argument("--write", type=Path, help="take the place of the results of this page")
    given = parser.parse_args()
    found = results(*given.seeds, given.kept)
    print(found)
    if given.write:
        words = given.write.read_text(encoding="utf-8").partition("## Seeds")[0]
        given.write.write_text(words + found, encoding="utf-8")


if __name__ == "__main__":
    main()
