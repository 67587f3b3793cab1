"""The files that a page speaks of and a reader brings along, made for its test; and what its commands must leave."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from recordings import RecordingWriter, SignalSpec, bundled, read, validate, write


def readme(folder: Path) -> None:
    """The CSV file of a stem test: time in s, pressure in kPa, stem in mm."""
    example = bundled("mixed")
    area = example.plant.diaphragm_area_m2
    assert area
    pressure, stem = example["force"].values / area / 1e3, 1e3 * example["position"].values
    table = np.column_stack([example.time, pressure, stem])
    np.savetxt(folder / "stem-test.csv", table, fmt="%.9g", delimiter=",", header="time,pressure,stem", comments="")


def recordings(folder: Path) -> None:
    """A recording, and one whose recorder died: its samples are in the journal."""
    write(folder / "rig.h5", bundled("step"))
    specs = [SignalSpec("time", "s", "time"), SignalSpec("position", "m", "output"), SignalSpec("force", "N", "input")]
    cut = folder / "cut-off.h5"
    writer = RecordingWriter(cut, specs)
    time = np.arange(50) / 100
    writer.append({"time": time, "position": 0.01 * np.sin(time), "force": 100 * np.cos(time)})
    journal = Path(f"{cut}.journal").read_bytes()
    writer.close()
    Path(f"{cut}.journal").write_bytes(journal)


def imports(folder: Path) -> None:
    """Tables of other programs."""
    (folder / "rig.csv").write_text("t,stem,thrust\n0,1,0.1\n10,2,0.2\n20,3,0.3\n", encoding="utf-8")
    (folder / "log.txt").write_text("1 4\n2 12\n3 20\n", encoding="utf-8")
    rows = "".join(f"{k};0;0;1,5;{k},5\n" for k in range(20))
    (folder / "rig4.csv").write_text("t;a;b;p;x\n" + rows, encoding="utf-8")


def fleet(folder: Path) -> None:
    """Step tests of three valves, one of them twice."""
    for name in ("FV-101", "FV-102/2024", "FV-102/2025", "FV-103"):
        path = folder / "plant" / f"{name}.h5"
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path, bundled("step"))


FILES: dict[str, Callable[[Path], None]] = {
    "README.md": readme,
    "docs/recordings.md": recordings,
    "docs/how-to/fleet.md": fleet,
    "docs/how-to/import.md": imports,
}
"""By page; a page that is not here makes its files itself."""


def after_readme(folder: Path) -> None:
    """The report has its pictures in it, and the bundled valve lacks nothing, as the page on tracing says."""
    assert (folder / "report.html").stat().st_size > 100_000
    assert json.loads((folder / "trace.json").read_text(encoding="utf-8"))["verdict"] == "none"


def after_recordings(folder: Path) -> None:
    """The files are valid, and what was cut off is whole."""
    assert validate(folder / "stem.h5") == validate(folder / "live.h5") == []
    assert len(read(folder / "whole.h5")) == 50


def after_imports(folder: Path) -> None:
    """Columns, units and formulas mean what the page says."""
    np.testing.assert_allclose(read(folder / "log.h5")["position"].values, [0.0, 0.01, 0.02])
    made = read(folder / "rig4.h5")
    assert (len(made), made.title) == (5, "Test rig 4")
    np.testing.assert_allclose(made["force"].values, 0.029 * 1.5e5)
    np.testing.assert_allclose(made["position"].values[0], 15.5e-3)


def after_tutorial(folder: Path) -> None:
    """Errors of fit and hold-out are the noise of the sensor, as the page says."""
    error = json.loads((folder / "model.json").read_text(encoding="utf-8"))["error"]
    assert 2e-6 < error["fit"]["rmse_m"] < 4e-6
    assert 2e-6 < error["holdout"]["rmse_m"] < 5e-6


def after_trace(folder: Path) -> None:
    """The effect is named."""
    answer = json.loads((folder / "trace.json").read_text(encoding="utf-8"))
    assert answer["verdict"] == "position_dependent_friction"


LEFT: dict[str, Callable[[Path], None]] = {
    "README.md": after_readme,
    "docs/recordings.md": after_recordings,
    "docs/how-to/import.md": after_imports,
    "docs/how-to/trace.md": after_trace,
    "docs/tutorial.md": after_tutorial,
}
"""What must be true once the blocks of a page have run."""
