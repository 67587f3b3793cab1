"""How often the joint posterior of valve and process holds the truth: loops with sticking stems, in Markdown.

    python -m studies.joint_posterior --seeds 8760 8960

Each seed is a loop of flow, pressure or temperature whose valve is a LuGre stem without a positioner.
"""

from __future__ import annotations

import argparse
from collections import Counter
from datetime import date
from pathlib import Path

from identification.loops import STROKE, LoopKind, assess_loop, simulated_loop
from identification.standard_tests import Interval
from studies.loop_judgement import OF_INTERVALS, of_intervals, show, table

KINDS: tuple[LoopKind, ...] = ("flow", "pressure", "temperature")
QUANTITIES = ("fs_N", "fc_N", "process_gain")


def results(first: int, last: int) -> str:
    """The tables."""
    count: Counter[str] = Counter()
    refused: Counter[str] = Counter()
    told: dict[str, list[tuple[float, Interval]]] = {name: [] for name in QUANTITIES}
    missed = []
    for seed in range(first, last):
        known = simulated_loop(seed, "stiction", KINDS[seed % len(KINDS)], "stem")
        assert known.stem
        values = known.stem.values
        found = assess_loop(known.loop, valve={"stroke": STROKE, "K": values["spring.K"]})
        count[found.verdict] += 1
        if found.joint is None:
            continue
        if found.joint.refused:
            refused[found.joint.refused] += 1
        truth = dict(zip(QUANTITIES, (values["lugre.fs"], values["lugre.fc"], known.gain), strict=True))
        for name, one in found.joint.values.items():
            told[name].append((truth[name], one))
            if not one.lower <= truth[name] <= one.upper:
                missed.append(f"{seed} ({name})")
    answers = ", ".join(f"{verdict} {n}" for verdict, n in count.items())
    given = count["stiction"] - sum(refused.values())
    rows = [[name, given - len(pairs), *of_intervals(pairs)] for name, pairs in told.items() if pairs]
    refusals = "; ".join(f"{n} times: {why}" for why, n in refused.items()) or "none"
    parts = (
        f"## Seeds {first} to {last - 1}, {date.today().isoformat()}",
        f"{last - first} loops: {answers}. Posteriors: {given}.",
        table(("quantity", "open", "told", *OF_INTERVALS), rows),
        f"Refused: {refusals}\n\nTruth outside: {', '.join(missed) or 'none'}\n",
    )
    return "\n\n".join(parts)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", nargs=2, type=int, default=(8760, 8960))
    parser.add_argument("--write", type=Path, help="take the place of the results of this page")
    given = parser.parse_args()
    show(results(*given.seeds), given.write)


if __name__ == "__main__":
    main()
