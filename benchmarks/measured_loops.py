"""What `bristle assess` and each of its methods say of measured loops, beside their labels, as a table in Markdown.

    python -m benchmarks.measured_loops

The loops are those of `loops/` in the folder of measured data. Rows are files, in the order of their loops; several
files are one loop on different days, so the last lines count loops.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.measured_data import DATA
from identification.loops import Assessment, LoopKind, assess_loop, loop_of
from recordings import BadInput

KINDS: dict[str, LoopKind] = {"F": "flow", "L": "level", "P": "pressure"}
ISDB = {"CHEM 12": (0, 2000), "CHEM 2": (2000, 3000), "CHEM 23": (3000, 4500), "CHEM 29": (4500, 11700)}
"""Loops of one pair of files, by their samples; their sampling interval is not said, and 1 s is taken."""


def refinery(folder: Path) -> Iterator[tuple[str, str, str, Assessment]]:
    """Loop, file, label and assessment of labelled refinery loops; what is refused is left out with a line."""
    with (folder / "labels.csv").open(encoding="utf-8") as table:
        rows = sorted(csv.DictReader(table), key=lambda row: (row["loop"], row["file"]))
    for row in rows:
        values = np.genfromtxt(folder / row["file"], skip_header=5, delimiter="\t", usecols=(1, 2, 3))
        kind = next((KINDS[letter] for letter in row["loop"][4:5] if letter in KINDS), None)
        time = np.asarray(np.arange(len(values)) * 10.0, float)
        try:
            loop = loop_of(row["file"], time, values[:, 2], values[:, 1], values[:, 0], True, kind)
        except BadInput as why:
            print(f"refused: {why}")
            continue
        yield row["loop"], row["file"].partition(".")[0], row["label"], assess_loop(loop)


def isdb(folder: Path) -> Iterator[tuple[str, str, str, Assessment]]:
    """The same of four loops that are known to stick."""
    op, pv = (np.genfromtxt(folder / f"12_2_23_29_{name}.csv.gz") for name in ("op", "pv"))
    for name, (first, last) in ISDB.items():
        y, u = pv[first:last], op[first:last]
        yield name, name, "stiction", assess_loop(loop_of(name, np.arange(float(len(y))), None, y, u, True, None))


def main() -> None:
    """Print the table, and the loops that are called sticky though their label says otherwise."""
    folder = DATA / "loops"
    print("| file | label | answer | for stiction | against | why not |\n| --- | --- | --- | --- | --- | --- |")
    answers: dict[tuple[str, str], list[str]] = defaultdict(list)
    for source in (refinery(folder / "refinery"), isdb(folder / "isdb")):
        for loop, file, label, found in source:
            says = {
                word: ", ".join(one.method for one in found.answers if one.says == word)
                for word in ("stiction", "no_stiction")
            }
            limits = "; ".join(one.words for one in found.problems if one.hides != "nothing")
            sure = "" if found.probability is None else f" {found.probability:.2f}"
            print(
                f"| {file} | {label} | {found.verdict}{sure} | {says['stiction']} | {says['no_stiction']} | {limits} |"
            )
            answers[loop, label].append(found.verdict)
    for (loop, label), said in answers.items():
        print(f"{loop} ({label}): {', '.join(f'{word} {said.count(word)}' for word in sorted(set(said)))}")


if __name__ == "__main__":
    main()
