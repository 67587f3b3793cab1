"""Friction models against the force that a recorded motion takes: `bristle fit --friction` as a call."""

from __future__ import annotations

from collections.abc import Iterable

import identification
from bristle.door.sources import RecordingLike, read_all
from identification import FRICTION_MODELS, FRICTION_RIG, FRICTION_VALVE, FrictionComparison, with_area, without_effects
from recordings import Progress, silent


def compare_friction(
    recordings: RecordingLike | Iterable[RecordingLike],
    *,
    holdout: RecordingLike | Iterable[RecordingLike] = (),
    models: Iterable[str] = (),
    without: Iterable[str] = (),
    area: float | None = None,
    hold: bool = False,
    progress: Progress = silent,
) -> FrictionComparison:
    """Fit friction models to recordings and compare them where they were not fitted.

    Every model is fitted to the force that the recorded motion takes, by separable least squares, beside mass, spring
    and preload. So it does not matter what drove the valve, and a model needs not be stable to be tried.

    Parameters
    ----------
    recordings, holdout, area, hold, progress
        As for `fit`. Without any held out, the last quarter of each recording judges.
    models : names, optional
        "coulomb", "asymmetric", "stribeck", "canudas", "root", "lugre", "leuven", "maxwell-slip", "backlash-like",
        "preisach"; all where not given.
    without : names, optional
        ``["spring"]`` for a rig without spring and moving mass: friction and a constant are all there is.

    Returns
    -------
    FrictionComparison
        `rows`, best first, each with `name`, `fit.values`, `fit.parameters`, `fitted_n` and `held_out_n`; `best`;
        `before_n`, the errors without friction; `write`.

    Raises
    ------
    BadInput
        A recording or a model cannot be used.

    >>> import bristle as br
    >>> found = br.compare_friction("bundled:sine", models=["coulomb", "lugre"])
    >>> [row.name for row in found.rows]
    ['lugre', 'coulomb']
    """
    plant = FRICTION_RIG if without_effects(without) else FRICTION_VALVE
    fitted, judging = (with_area(read_all(some), area) for some in (recordings, holdout))
    return identification.compare_friction(
        fitted, holdout=judging, models=tuple(models) or tuple(FRICTION_MODELS), plant=plant, hold=hold,
        progress=progress,
    )  # fmt: skip
