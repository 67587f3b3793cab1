"""What does the model lack? Trace an effect that nobody declared.

    python examples/trace_effect.py [FOLDER]

The valve has play in its linkage: the sensor follows the stem only after the play is used up. The fitted model of
friction and spring does not know that. A trace finds the effect, adds it, and judges it on data that were held out.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bristle as br

NOISE = {"position_noise": 5e-6, "force_noise": 0.2}
"""Standard deviations of the sensors' noise [m], [N]."""


def main(folder: Path) -> None:
    """Simulate a valve with play, trace it, and write answer, model and report to a folder."""
    fitted, judging = (
        br.simulate(course, effects=["backlash"], given={"backlash.width": 2e-4}, rate=250, seed=3, **NOISE)
        for course in ("staircase:12,sine:8", "mixed:12")
    )

    found = br.trace(fitted, holdout=judging, progress=lambda stage, done, total: print(f"  {stage} {done}/{total}"))
    print(found)
    for sentence in found.sentences():
        print(sentence)
    if "backlash.width" in found.values:
        print(f"play: {1e3 * found.values['backlash.width']:.3f} mm; it was simulated with 0.200 mm")

    found.write(folder / "trace.json")
    found.model.write(folder / "traced.json")
    found.report(folder / "trace.html")
    print(f"wrote trace.json, traced.json and trace.html to {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
