"""Figure 4.3: detection time over k2, for the two faults of Section 4.4. Run: python -m studies.figure43"""

from __future__ import annotations

import numpy as np

from detector.published import section_4_4
from studies import drawing
from studies.plant import FaultName, learned
from studies.section44 import PUBLISHED, Detection, detect, seconds

GAINS = (100.0, 200.0, 300.0, 400.0, 600.0, 800.0, 1000.0)


def sweep(gains: tuple[float, ...] = GAINS) -> dict[float, dict[FaultName, Detection]]:
    """Both faults for every k2, the observer having learned 60 s with that k2."""
    found: dict[float, dict[FaultName, Detection]] = {}
    for k2 in gains:
        before, state, _ = learned(section_4_4(k2))
        found[k2] = {fault: detect(before, state, fault, k2=k2) for fault in PUBLISHED}
    return found


def main() -> None:
    """Write docs/studies/figure43.md and .svg."""
    found = sweep()
    rows = [
        [f"{k2:.0f}", *(seconds(t) for one in both.values() for t in (one.holds_s, one.crosses_s))]
        for k2, both in found.items()
    ]
    head = ["k2 [1/s]", *(f"{fault}: {what} [s]" for fault in PUBLISHED for what in ("(4.32) holds", "crosses"))]
    note = "Both times fall here from k2 = 200 on. Theorem 3's claim that they do so in general is not true."
    print(drawing.table("figure43", "Figure 4.3: detection time over k2", head, rows, note))
    figure, axis = drawing.axes(1, 1, (4.5, 2.8))
    for fault, colour in zip(PUBLISHED, ("C3", "C0"), strict=True):
        for attribute, style in (("holds_s", "o-"), ("crosses_s", ".:")):
            times = [getattr(both[fault], attribute) for both in found.values()]
            milli = [np.nan if t is None else 1e3 * t for t in times]
            label = f"{fault}: {'(4.32) holds' if attribute == 'holds_s' else 'residual crosses'}"
            axis.plot(list(found), milli, style, color=colour, ms=3, label=label)
    axis.set(xlabel="k2 [1/s]", ylabel="detection time [ms]")
    axis.legend(frameon=False)
    drawing.save(figure, "figure43")


if __name__ == "__main__":
    main()
