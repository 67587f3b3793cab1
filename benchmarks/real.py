"""Tracing of real measurements, every row of docs/studies/real-measurements.md.

    python -m benchmarks.real                 all rows (seven minutes of processor time)
    python -m benchmarks.real --only emps     the rows whose name holds a word
    python -m benchmarks.real --out FOLDER    writes the trace.json of every row as well

Needs the folder of measured data (BRISTLE_DATA). Nothing is given but that there is no spring. The last quarter of
every recording is held out. Its first three quarters judge; the errors in the table are those on its last quarter,
which neither fitted nor judged. In one row another recording is held out as a whole, and divided alike. For EMPS the
official validation file is predicted as well, and scored as the authors of the data do it (`emps_scoring.py`).
"""

from __future__ import annotations

import argparse
import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks import emps_scoring as emps
from benchmarks.machine import commit, machine, today
from benchmarks.measured_data import DATA, imported
from identification import Identification, Trace, trace
from recordings import NegativeAnswer, Recording


@dataclass(frozen=True)
class Row:
    """Measured files that are traced together. mapping : reads them; hold : their force is held between samples;
    held_out : files that judge and report in the place of their last quarters.
    """

    name: str
    files: tuple[str, ...]
    mapping: str
    hold: bool = False
    held_out: tuple[str, ...] = ()

    def recordings(self) -> list[Recording]:
        """Those that are fitted. Raises BadInput when the measured data are not here."""
        return [imported(DATA / file, self.mapping) for file in self.files]

    def traced(self) -> Trace:
        """What is found in them. Raises BadInput when the measured data are not here, NegativeAnswer for a refusal."""
        others = [imported(DATA / file, self.mapping) for file in self.held_out]
        return trace(self.recordings(), holdout=others, given={"spring.K": 0.0}, hold=self.hold)


def cylinder(seal: str, *bars: int) -> Row:
    """The pneumatic cylinder with one seal at some pressures [bar]."""
    mapping = "pneumatic-cylinder-257" if "257" in seal else "pneumatic-cylinder"
    files = tuple(f"pneumatic_cylinder_seals/friction/{seal}_{bar}bar.csv.gz" for bar in bars)
    return Row(f"cylinder, {seal}, {', '.join(map(str, bars))} bar", files, mapping)


def kinova(*speeds: float) -> Row:
    """The robot joint at some speeds [rad/s]."""
    files = tuple(f"kinova_joint7_friction/velocity_{speed:.6f}readings.csv.gz" for speed in speeds)
    return Row(f"Kinova joint 7, {len(speeds)} speeds", files, "kinova-joint7")


EMPS = Row("EMPS drive", (f"emps/{emps.FITTED}.mat",), "emps", hold=True)
EMPS_WITH_PULSES = Row(
    "EMPS drive, held out: its file with pulses", EMPS.files, "emps", hold=True, held_out=(f"emps/{emps.OFFICIAL}.mat",)
)

ROWS = (
    EMPS,
    EMPS_WITH_PULSES,
    cylinder("O-ring", 1, 3, 5, 7),
    cylinder("O-ring", 5),
    cylinder("Stadium", 1, 2, 3),
    cylinder("NAPN", 1, 3, 5, 7),
    cylinder("PK", 1, 3, 5, 7),
    cylinder("O-ring257", 1, 3, 5, 7),
    cylinder("Circle", 2, 4, 6),
    cylinder("Kidney", 1, 2, 3, 4),
    cylinder("Kidney_lc", 1, 3, 5, 6),
    Row("tribometer", ("tribometer_presliding/test_data_2.txt.gz",), "tribometer"),
    kinova(0.03, 0.05, 0.09, 0.1, 0.3),
)


HEAD = (
    "recordings", "before, reported part [N]", "effects", "after, reported part [N]", "noise floor [N]",
    "sparse regression", "time (processor)",
)  # fmt: skip


def line(row: Row, found: Trace, seconds: float) -> str:
    """A row of the page: errors on what neither fitted nor judged."""
    before, after = (_error(found, side) for side in ("before", "after"))
    names = ", ".join(found.effects_added) or f"`{found.verdict}`"
    opinion = found.second_opinion
    other = "-" if opinion is None else f"{opinion.effect} ({100 * opinion.share:.0f} %)"
    floor = found.error["noise_floor_N"]
    return f"| {row.name} | {before} | {names} | {after} | {floor:.3g} | {other} | {seconds:.0f} s |"


def _error(found: Trace, side: str) -> str:
    """With a word beside it where the recordings were too short for a part that only reports."""
    rmse = found.error[side][found.reported]["rmse_N"]
    return f"{rmse:.3g}" + ("" if found.reported == "report" else " (judged)")


def official(found: Trace) -> Iterator[str]:
    """The published models, and the models before and after, on both files of EMPS, with their ends and without."""
    files = [emps.measured(name) for name in (emps.FITTED, emps.OFFICIAL)]
    cells = [
        name + ends for ends in ("", f", last {emps.END} samples dropped") for name in (emps.FITTED, emps.OFFICIAL)
    ]
    yield _cells("model", "position", *cells)
    yield "|" + " --- |" * (2 + len(cells))
    for name, published in (("published: symmetric", emps.SYMMETRIC), ("published: asymmetric", emps.ASYMMETRIC)):
        errors = [emps.published_error(published, r, end) for end in (0, emps.END) for r in files]
        yield _cells(name, "filtered by the authors", *_percent(errors))
    for position, some in (("as recorded", files), ("filtered by the authors", [emps.filtered(r) for r in files])):
        for name, model in _models(found).items():
            errors = [emps.model_error(model, r, end) for end in (0, emps.END) for r in some]
            yield _cells(name, position, *_percent(errors))


def _models(found: Trace) -> dict[str, Identification]:
    return {"base (LuGre)": found.base, "+ " + ", ".join(found.effects_added): found.final}


def _cells(*words: str) -> str:
    return f"| {' | '.join(words)} |"


def _percent(errors: list[float]) -> list[str]:
    return [f"{100 * error:.2f} %" for error in errors]


def shown(row: Row, folder: Path | None) -> Trace | None:
    """Trace a row and print it; with a folder, keep its trace.json there."""
    start = time.process_time()
    try:
        found = row.traced()
    except NegativeAnswer as refusal:
        print(f"| {row.name} | - | no answer: {refusal} | - | - | - | - |", flush=True)
        return None
    print(line(row, found, time.process_time() - start), flush=True)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        found.write(folder / (re.sub(r"[^A-Za-z0-9]+", "_", row.name) + ".json"))
    return found


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="rows whose name holds this word")
    parser.add_argument("--out", type=Path, help="folder for the trace.json of every row")
    options = parser.parse_args()
    print(f"{today()}, commit {commit()}")
    print(machine("casadi", "numpy", "scipy", "pysindy"))
    print(_cells(*HEAD), "|" + " --- |" * len(HEAD), sep="\n", flush=True)
    rows = [row for row in ROWS if options.only.lower() in row.name.lower()]
    drive = None
    for row in rows:
        found = shown(row, options.out)
        drive = found if row is EMPS else drive
    if drive is not None:
        print("", *official(drive), sep="\n", flush=True)


if __name__ == "__main__":
    main()
