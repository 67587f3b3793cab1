"""Arrays to a model and a report: fit the friction and the spring of a valve.

    python examples/fit_arrays.py [FOLDER]

The arrays are simulated here. With your own data, load them from wherever they are: time in s, the position of the
stem, and the force on it (or the pressure in the actuator, with the area of its diaphragm).
"""

from __future__ import annotations

import sys
from pathlib import Path

import bristle as br

TRUE = {"spring.K": 4.0e4, "lugre.fc": 150.0, "lugre.fs": 190.0}
"""The valve that the example simulates: rate of its spring [N/m], friction while sliding and at breakaway [N]."""


def main(folder: Path) -> None:
    """Make arrays, fit a valve to them, and write the model and the report to a folder."""
    test = br.simulate("mixed:20", given=TRUE, position_noise=2e-6, seed=3)
    time, position, force = (test[name].values for name in ("time", "position", "force"))

    # From here on only arrays are used. Other units are given by name: units={"position": "mm", "force": "kN"}.
    recording = br.Recording.from_arrays(time=time, position=position, force=force, title="stem test")
    found = br.fit(recording)
    print(found)

    for name, true in TRUE.items():
        fitted = found.model.parameters[name]
        print(f"{name:9} {fitted.value:9.5g} ± {fitted.std or 0.0:.2g} {fitted.unit:5} true {true:g}")

    found.write(folder / "model.json")
    found.report(folder / "report.html")
    print(f"wrote model.json and report.html to {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
