"""What the linear generators of Chapter 3 are on the benchmark's fault-free valve, as docs/generators.md tables it.

    python -m benchmarks.generators

Learned on two hours (seed 901), judged on three others (seed 902): how white the innovations of a Kalman filter are,
and what each residual of the structured set sees, asked of the learned plant.
"""

from __future__ import annotations

import numpy as np

from benchmarks.machine import machine
from detector.evaluation import Setting, healthy, inputs, linearise, outputs
from detector.generators import KalmanResiduals, all_but_one, isolates, learn_innovation_form, settled, structured
from recordings import Array

LEARNED, JUDGED = Setting(seed=901), Setting(seed=902)
RUN_IN_S = 100
FAULTS = ("sensor of X", "sensor of F", "set point")


def fault_free(setting: Setting, hours: float) -> Array:
    """Signals (n_seconds, 6) after the run-in."""
    return healthy(3600 * hours + RUN_IN_S, setting)[1][RUN_IN_S:]


def innovations(watch: KalmanResiduals, u: Array, y: Array) -> tuple[Array, Array]:
    """Lag-1 correlation and variance of the innovations of each output, which are to be 0 and 1."""
    r = watch.run(watch.initial(), u, y)[1][RUN_IN_S:]
    off = r - r.mean(axis=0)
    return (off[1:] * off[:-1]).mean(axis=0) / r.var(axis=0), r.var(axis=0)


def show_innovations(learned: Array, judged: Array) -> None:
    """The filter of a good engineer, and the one without."""
    forms = {
        "three past readings, without the cross-covariance": ((3,), 2),
        "depth by the Schwarz criterion, with it": ((2, 4, 8, 12, 20, 30), 3),
    }
    for name, (depths, covariances) in forms.items():
        model = learn_innovation_form(inputs(learned), outputs(learned), depths)
        watch = settled(model.plant, *model.covariances[:covariances])
        found = innovations(watch, inputs(judged) - model.means[0], outputs(judged) - model.means[1])
        depth = model.plant.order // model.plant.sizes[1]
        shown = "   ".join(", ".join(f"{value:.2f}" for value in row) for row in found)
        print(f"{name} (depth {depth}): lag-1 correlation and variance of X, F: {shown}")


def show_isolability(learned: Array) -> None:
    """Which residual sees which fault, by the model alone."""
    table = structured(linearise(learned).plant, all_but_one(len(FAULTS))).isolability()
    for blind, row in zip(FAULTS, table, strict=True):
        print(f"blind to the {blind}: sees {', '.join(np.array(FAULTS)[row])}")
    print(f"the set isolates {isolates(table)}")


def main() -> None:
    """Print both tables."""
    print(machine("numpy", "scipy"))
    learned = fault_free(LEARNED, 2)
    show_innovations(learned, fault_free(JUDGED, 3))
    show_isolability(learned)


if __name__ == "__main__":
    main()
