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

TIMELESS = ("coulomb", "lugre", "leuven", "maxwell-slip", "backlash-like", "preisach")
"""What can be asked of a signature, which has no time."""
PACE_M_S = 1e-3
"""Speed at which its points are taken to follow one another: at one speed nothing can depend on the speed."""
ASKED = ("preisach", "maxwell-slip", "leuven", "backlash-like", "lugre")
"""What is drawn."""


def tribometer() -> FrictionComparison:
    """Presliding loops, the last quarter held out."""
    recording = imported(DATA / "tribometer_presliding/test_data_2.txt.gz", "tribometer")
    return compare_friction([recording], plant=FRICTION_RIG)


def signature() -> FrictionComparison:
    """The signature, every second point held out."""
    whole = with_area([imported(DATA / "damadics/fig5_valve_signature.csv", "valve-signature")], AREA_M2)[0]
    halves = [_every_second(whole, first) for first in (0, 1)]
    return compare_friction(halves[:1], holdout=halves[1:], models=TIMELESS, plant=("spring.K", "spring.F0"))


def _every_second(whole: Recording, first: int) -> Recording:
    """The loop gone through twice, with the pressure of every second point alone."""
    n = len(whole.time)
    position, pressure = (np.tile(whole.si(name).values, 2) for name in ("position", "pressure"))
    time = np.cumsum(np.maximum(np.abs(np.diff(position, prepend=position[0])), 1e-5)) / PACE_M_S
    stopped = (position / STROKE_M < 0.002) | (position / STROKE_M > 1.054)  # there the stem tells nothing of friction
    other = np.tile(np.arange(n) % 2 == first, 2)
    return Recording.from_arrays(
        time=time, position=position, pressure=np.where(stopped | other, np.nan, pressure),
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
    """The last loop held out, and the points of the signature, less its spring; and what the models make of them."""
    figure, axes = drawing.axes(1, 2, (7.0, 3.4))
    loops, curve = found.held_out[0], valve.held_out[0]
    last = slice(-300, None)
    at = 1e6 * (loops.path.x - loops.path.x.mean())
    axes[0].plot(at[last], loops.u[last], color="0.7", lw=3, label="measured")
    second = slice(len(curve.u) // 2, None)
    x, u, counts = curve.path.x[second], curve.u[second], curve.counts[second]
    spring = np.polynomial.Polynomial.fit(x[counts], u[counts], 1)
    axes[1].plot(1e3 * x[counts], (u - spring(x))[counts], "o", ms=3, color="0.6", label="measured")
    for name in ASKED:
        one, other = ({row.name: row for row in rows}[name] for rows in (found.rows, valve.rows))
        axes[0].plot(at[last], one.fit.force(loops)[last], label=name)
        axes[1].plot(1e3 * x, other.fit.force(curve)[second] - spring(x), label=name)
    axes[0].set(title="tribometer, last loop held out", xlabel="x [µm]", ylabel="friction [N]")
    axes[1].set(title="valve signature, points held out", xlabel="x [mm]", ylabel="force less a straight spring [N]")
    axes[0].legend(fontsize=6)
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
        "table of any recording.\n\n"
        "The output of (2.39) and (2.52) is late, and a friction leads: as frictions they are a slope less such an "
        "output. Maxwell slip is a case of the Preisach model, whose grid resolves it where there are thousands of "
        "samples, as on the tribometer. A signature has some forty points of one loop, which does not carry "
        "first-order curves; so its grid is of four cells a side, and the hysteresis, narrow against the stroke, falls "
        "between its levels. A signature has no time either: its points follow one another at one speed, so that "
        "nothing depends on the speed."
    )
    head = ("data", "model", "", "parameters", "fitted [N]", "held out [N]")
    rows = [*table(rig, "tribometer"), *table(valve, "signature")]
    print(drawing.table("friction-models", "Friction models on measured loops", head, rows, note))


if __name__ == "__main__":
    main()
