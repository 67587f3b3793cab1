"""An effect of your own: written once, then simulated and fitted like those of the toolkit.

    python examples/own_effect.py [FOLDER]

The effect here is a magnet that pulls the stem towards the closed end of the stroke. Nothing of the toolkit is
changed: a catalogue that has the effect is handed to the functions that are to know it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import bristle as br

PULL = 120.0
"""Force of the magnet at the closed end [N]."""


class Magnet(br.Effect):
    """A pull that falls off with the square of the distance: G / (1 + x / D)^2."""

    id = "magnet"
    site = br.Site.FORCE
    sentence = "A magnet pulls the stem towards the closed end"
    check = "whether the stem is magnetised"
    parameters = (
        br.Parameter("G", "N", "pull at the closed end", scale=50.0, neutral=0.0),
        br.Parameter("D", "m", "distance at which a quarter of it is left", scale=3e-3, lower=1e-3, upper=2e-2),
    )

    def force(self, q: Any, p: Any, s: Any, ds: Any) -> Any:
        """The force against the motion [N], of the position q.x [m] and the parameters p, as expressions."""
        return p["G"] / (1.0 + q.x / p["D"]) ** 2


OURS = br.CATALOGUE.extended(Magnet())
GIVEN = {"magnet.G": PULL, "magnet.D": 3e-3}


def main(folder: Path) -> None:
    """Simulate a valve with the magnet, fit it without and with the magnet, and write the better model to a folder."""
    fitted, judging = (
        br.simulate(
            course, effects=["magnet"], catalogue=OURS, given=GIVEN, rate=250, seed=3, position_noise=5e-6,
        )
        for course in ("staircase:8,sine:6", "mixed:8")
    )  # fmt: skip

    plain = br.fit(fitted, holdout=judging, crosscheck=False)
    own = br.fit(fitted, holdout=judging, effects=["magnet"], catalogue=OURS, crosscheck=False)
    for name, found in (("without", plain), ("with", own)):
        print(f"{name} the magnet: held-out error {1e6 * found.model.error['holdout']['rmse_m']:.1f} um")
    print(f"pull: {own.values['magnet.G']:.1f} N; it was simulated with {PULL:.1f} N")

    own.write(folder / "magnet-model.json")
    own.report(folder / "magnet.html")
    print(f"wrote magnet-model.json and magnet.html to {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
