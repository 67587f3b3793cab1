"""Friction models against the force that a recorded motion takes, or in free runs: `bristle fit --friction`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import identification
from bristle.door.sources import RecordingLike, read_all
from identification import (
    FREE_FRICTION_MODELS,
    FRICTION_MODELS,
    FRICTION_RIG,
    FRICTION_VALVE,
    FreeComparison,
    FrictionComparison,
    with_area,
    without_effects,
)
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


def compare_free_runs(
    recordings: RecordingLike | Iterable[RecordingLike],
    *,
    holdout: RecordingLike | Iterable[RecordingLike] = (),
    models: Iterable[str] = (),
    given: Mapping[str, float] | None = None,
    area: float | None = None,
    hold: bool = False,
    progress: Progress = silent,
) -> FreeComparison:
    """Fit valves with different friction to force-driven recordings and compare them by free runs.

    A free run starts with the first sample, and from there on only the recorded force enters: what is compared is where
    the stem goes. So a model has to hold a resting stem, and what has no such form is refused with the reason.

    Parameters
    ----------
    recordings, holdout, given, area, hold, progress
        As for `fit`. Without any held out, the last quarter of each recording judges.
    models : names, optional
        "coulomb", "asymmetric", "stribeck", "lugre", "leuven"; all where not given.

    Returns
    -------
    FreeComparison
        `rows`, best first, each with `name`, `values`, `parameters`, `fitted_m` and `held_out_m`;
        `best`; `write`.

    Raises
    ------
    BadInput
        A recording or a model cannot be used, or the motion is imposed.

    >>> import bristle as br
    >>> found = br.compare_free_runs("bundled:step", models=["lugre"])
    >>> bool(found.best.held_out_m < 1e-5)
    True
    """
    fitted, judging = (with_area(read_all(some), area) for some in (recordings, holdout))
    return identification.compare_free_runs(
        fitted, holdout=judging, models=tuple(models) or tuple(FREE_FRICTION_MODELS), given=given, hold=hold,
        progress=progress,
    )  # fmt: skip
