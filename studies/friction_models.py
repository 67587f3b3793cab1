"""Friction models on measured loops: a tribometer in presliding, and the signature of a valve.

    python -m studies.friction_models

The tribometer's last quarter, eight loops, judges; of the signature every second point does. Needs the folder of
measured data (BRISTLE_DATA).
"""

from __future__ import annotations

import numpy as np

from benchmarks.measured_data import DATA, imported
from identification import FRICTION_RIG, FrictionComparison, compare_friction, with_area
from recordings import Recording
from studies import drawing

AREA_M2 = 0.029
"""Diaphragm of the actuator whose signature it is, by the benchmark's name plate."""

STROKE_M = 0.0381

RATE_INDEPENDENT = ("coulomb", "lugre", "leuven", "maxwell-slip", "backlash-like")
"""What can be asked of a signature, which has no time."""


def tribometer() -> FrictionComparison:
    """Presliding loops, the last quarter held out."""
    recording = imported(DATA / "tribometer_presliding/test_data_2.txt.gz", "tribometer")
    return compare_friction([recording], plant=FRICTION_RIG)


def signature() -> FrictionComparison:
    """The signature, every second point held out."""
    whole = with_area([imported(DATA / "damadics/fig5_valve_signature.csv", "valve-signature")], AREA_M2)[0]
    halves = [_every_second(whole, first) for first in (0, 1)]
    return compare_friction(halves[:1], holdout=halves[1:], models=RATE_INDEPENDENT, plant=("spring.K", "spring.F0"))


def _every_second(whole: Recording, first: int) -> Recording:
    """The loop gone through twice, with the pressure of every second point alone."""
    n = len(whole.time)
    position, pressure = (np.tile(whole.si(name).values, 2) for name in ("position", "pressure"))
    stopped = (position / STROKE_M < 0.002) | (position / STROKE_M > 1.054)  # there the stem tells nothing of friction
    other = np.tile(np.arange(n) % 2 == first, 2)
    return Recording.from_arrays(
        time=np.arange(2 * n, dtype=float), position=position, pressure=np.where(stopped | other, np.nan, pressure),
        plant=whole.plant, title=whole.title,
    )  # fmt: skip


def table(found: FrictionComparison, where: str) -> list[list[str]]:
    """Rows of the page."""
    rows = [
        [where, row.name, row.fit.model.text, str(row.fit.parameters), f"{row.fitted_n:.3g}", f"{row.held_out_n:.3g}"]
        for row in found.rows
    ]
    return [*rows, [where, "none", "before: no friction", "-", *(f"{value:.3g}" for value in found.before_n)]]


def draw(found: FrictionComparison, valve: FrictionComparison) -> None:
    """The last loops held out, and what three models make of them."""
    figure, axes = drawing.axes(1, 2, (7.0, 3.0))
    loops = found.held_out[0]
    last = slice(-600, None)
    axes[0].plot(1e3 * loops.path.x[last], loops.u[last], color="0.6", lw=2.5, label="measured")
    for row in found.rows:
        if row.name in ("lugre", "maxwell-slip", "coulomb"):
            axes[0].plot(1e3 * loops.path.x[last], row.fit.force(loops)[last], label=row.name)
    axes[0].set(title="tribometer, held out", xlabel="x [mm]", ylabel="friction [N]")
    curve = valve.held_out[0]
    axes[1].plot(1e3 * curve.path.x, curve.u, ".", color="0.6", label="measured")
    axes[1].plot(1e3 * curve.path.x, valve.best.fit.force(curve), label=valve.best.name)
    axes[1].set(title="valve signature, every second point", xlabel="x [mm]", ylabel="force [N]")
    for one in axes:
        one.legend(fontsize=6)
    drawing.save(figure, "friction-models")


def main() -> None:
    """Write docs/studies/friction-models.md and its picture."""
    rig, valve = tribometer(), signature()
    draw(rig, valve)
    note = (
        "`python -m studies.friction_models` writes this page from the measured data. RMS error of the force that a "
        "model predicts for the recorded motion; what is held out was not fitted. The models are those of "
        "[friction](../models/friction.md), [LuGre](../models/lugre.md), [Leuven](../models/leuven.md), "
        "[backlash](../models/backlash.md) and [Preisach](../models/preisach.md); `bristle fit --compare` makes such a "
        "table of any recording."
    )
    head = ("data", "model", "", "parameters", "fitted [N]", "held out [N]")
    rows = [*table(rig, "tribometer"), *table(valve, "signature")]
    print(drawing.table("friction-models", "Friction models on measured loops", head, rows, note))


if __name__ == "__main__":
    main()
