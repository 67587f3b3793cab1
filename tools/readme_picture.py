"""Draw the picture of the README: the valve signature of a bundled recording, measured and simulated.

Run from the repository: python -m tools.readme_picture
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt

from identification import identify
from recordings import bundled


def main() -> None:
    """Write docs/identified.svg."""
    found = identify([bundled("step"), bundled("sine")], holdout=[bundled("mixed")], check=False)
    run, values = found.holdout[0], found.fit.values
    mpl.rcParams.update({"font.size": 9, "svg.hashsalt": "bristle", "svg.fonttype": "none"})
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    part = slice(0, 5000, 20)
    left.plot(run.t[part], 1e3 * run.measured[part], color="0.65", lw=3, label="measured, held out")
    left.plot(run.t[part], 1e3 * run.simulated[part], color="C3", lw=0.9, label="simulated, free run")
    left.set(xlabel="time [s]", ylabel="stem position [mm]", ylim=(0, 36))
    left.legend(frameon=False, loc="upper right")
    friction = run.force - values["spring.K"] * run.position - values["spring.F0"]
    moving = np.abs(run.velocity) > 5e-4
    right.plot(1e3 * run.velocity[moving][::12], friction[moving][::12], ".", color="0.75", ms=3, label="from the data")
    v = np.geomspace(2e-4, 0.06, 300)
    level = values["lugre.fc"] + (values["lugre.fs"] - values["lugre.fc"]) * np.exp(-((v / values["lugre.vs"]) ** 2))
    for sign in (1, -1):
        label = "LuGre, fitted" if sign > 0 else None
        right.plot(sign * 1e3 * v, sign * (level + values["lugre.sigma2"] * v), color="C3", lw=1.2, label=label)
    right.set(xlabel="velocity [mm/s]", ylabel="friction [N]", ylim=(-230, 230), xlim=(-60, 60))
    right.legend(frameon=False, loc="lower right")
    figure.savefig(Path(__file__).resolve().parent.parent / "docs" / "identified.svg", metadata={"Date": None})
    figure.savefig("/tmp/identified.png", dpi=80)


if __name__ == "__main__":
    main()
