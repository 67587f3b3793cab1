"""Tracing of real measurements, every row of docs/studies/real-measurements.md.

    python -m benchmarks.real                 all rows (five minutes of processor time)
    python -m benchmarks.real --only emps     the rows whose name holds a word

Needs the folder of measured data (BRISTLE_DATA). Nothing is given but that there is no spring. The last quarter of
every recording judges and reports. For EMPS the official validation file is predicted as well, scored as the authors of
the data do it: measured and predicted force decimated by ten with a zero-phase filter, the norm of their difference
over the norm of the measured one (A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.signal import decimate

from benchmarks.machine import machine
from benchmarks.measured_data import DATA, imported
from identification import Identification, Trace, trace
from recordings import NegativeAnswer, Recording

AUTHORS_DECIMATION = 10
AUTHORS_EDGE = 49
"""Samples left out at both ends, and one sample of how many is kept, as the authors of EMPS have it."""


@dataclass(frozen=True)
class Row:
    """Measured files that are traced together. mapping : reads them; hold : their force is held between samples."""

    name: str
    files: tuple[str, ...]
    mapping: str
    hold: bool = False

    def recordings(self) -> list[Recording]:
        """Raises BadInput when the measured data are not here."""
        return [imported(DATA / file, self.mapping) for file in self.files]


def cylinder(seal: str, *bars: int) -> Row:
    """The pneumatic cylinder with one seal at some pressures [bar]."""
    mapping = "pneumatic-cylinder-257" if "257" in seal else "pneumatic-cylinder"
    files = tuple(f"pneumatic_cylinder_seals/friction/{seal}_{bar}bar.csv.gz" for bar in bars)
    return Row(f"cylinder, {seal}, {', '.join(map(str, bars))} bar", files, mapping)


def kinova(*speeds: float) -> Row:
    """The robot joint at some speeds [rad/s]."""
    files = tuple(f"kinova_joint7_friction/velocity_{speed:.6f}readings.csv.gz" for speed in speeds)
    return Row(f"Kinova joint 7, {len(speeds)} speeds", files, "kinova-joint7")


ROWS = (
    Row("EMPS drive", ("emps/DATA_EMPS.mat",), "emps", hold=True),
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


def line(row: Row, found: Trace, seconds: float) -> str:
    """A row of the page: errors on what judged."""
    before, after = (found.error[side]["holdout"]["rmse_N"] for side in ("before", "after"))
    names = ", ".join(found.effects_added) or f"`{found.verdict}`"
    opinion = found.second_opinion
    other = "-" if opinion is None else f"{opinion.effect} ({100 * opinion.share:.0f} %)"
    floor = found.error["noise_floor_N"]
    return f"| {row.name} | {before:.3g} | {names} | {after:.3g} | {floor:.3g} | {other} | {seconds:.0f} s |"


def authors_error(model: Identification, recording: Recording) -> float:
    """Relative error [1] of the predicted force of EMPS, as its authors score it."""
    run = model.on([recording], hold=True)[0]
    seen = np.isfinite(run.measured) & np.isfinite(run.simulated)
    measured, predicted = (_decimated(z[seen]) for z in (run.measured, run.simulated))
    return float(np.linalg.norm(measured - predicted) / np.linalg.norm(measured))


def _decimated(z: np.ndarray) -> np.ndarray:
    kept = z[AUTHORS_EDGE:-AUTHORS_EDGE]
    return np.asarray(decimate(kept, AUTHORS_DECIMATION, ftype="iir", zero_phase=True))


def official(found: Trace) -> Iterator[str]:
    """The models before and after on both files of EMPS."""
    files = [imported(DATA / f"emps/{name}.mat", "emps") for name in ("DATA_EMPS", "DATA_EMPS_PULSES")]
    yield "| model, fitted to DATA_EMPS | DATA_EMPS | DATA_EMPS_PULSES |"
    yield "| --- | --- | --- |"
    models = {"base (LuGre)": found.base, "+ " + ", ".join(found.effects_added): found.final}
    for name, model in models.items():
        yield "| " + " | ".join([name, *(f"{100 * authors_error(model, r):.2f} %" for r in files)]) + " |"
    yield "| published: symmetric | 4.08 % | 5.98 % |"
    yield "| published: asymmetric (on PULSES: computed from the published values) | 3.11 % | 5.36 % |"


def main() -> None:
    """Print the tables."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--only", default="", help="rows whose name holds this word")
    only = options.parse_args().only.lower()
    print(machine("casadi", "numpy", "scipy", "pysindy"))
    head = "| recordings | before [N] | effects | after [N] | noise floor [N] | sparse regression | time (processor) |"
    print(head, "|" + " --- |" * 7, sep="\n", flush=True)
    emps = None
    for row in ROWS:
        if only in row.name.lower():
            start = time.process_time()
            try:
                found = trace(row.recordings(), given={"spring.K": 0.0}, hold=row.hold)
            except NegativeAnswer as refusal:
                print(f"| {row.name} | - | no answer: {refusal} | - | - | - | - |", flush=True)
                continue
            print(line(row, found, time.process_time() - start), flush=True)
            emps = found if row.name.startswith("EMPS") else emps
    if emps is not None:
        print("", *official(emps), sep="\n", flush=True)


if __name__ == "__main__":
    main()
