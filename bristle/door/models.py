"""A model of a valve from recordings of it: `bristle fit` and `bristle trace` as calls."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal, get_args

import identification
from bristle.door.sources import RecordingLike, read_all
from identification import Estimator, Identification, Order, Trace, with_area, without_effects
from recordings import BadParameter, Progress, silent
from simulator import BASE, CATALOGUE, Catalogue, Causality

ORDERS = ("auto", *get_args(Order))
"""What may be asked of the order of a model."""
CAUSALITIES = ("force", "motion")
"""What may drive the model: the recorded force, or the recorded motion."""


def fit(
    recordings: RecordingLike | Iterable[RecordingLike],
    *,
    holdout: RecordingLike | Iterable[RecordingLike] = (),
    effects: Iterable[str] = (),
    given: Mapping[str, float] | None = None,
    without: Iterable[str] = (),
    causality: Causality | None = None,
    area: float | None = None,
    hold: bool = False,
    estimator: Estimator = "auto",
    order: Order | Literal["auto"] = "auto",
    priors: Mapping[str, tuple[float, float]] | None = None,
    constraints: Iterable[str] = (),
    bootstrap: int = 0,
    repeats: bool = False,
    budget: float = float("inf"),
    crosscheck: bool = True,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Identification:
    """Fit LuGre friction and spring of a valve to recordings of it. No starting values are needed.

    Parameters
    ----------
    recordings : recording, path or ``bundled:NAME``, or several of them
        Fitted together. Each holds time, position, and force (or pressure, with an area).
    holdout : the same
        Recordings that only judge the fit.
    effects : names, optional
        Effects that the model has besides mass, spring and LuGre friction: ``["hardening_spring"]``.
    given : mapping, optional
        Parameters to hold, by full name, in SI units: ``{"mass.m": 2.1}``.
    without : names, optional
        ``["spring"]`` for a plant without one.
    causality : {"force", "motion"}, optional
        What drives the model. The roles of the recorded signals decide otherwise.
    area : float, optional
        Area of the diaphragm [m2], to turn pressure into force.
    hold : bool, optional
        Whether the force is held between samples, as the output of a converter is.
    estimator : {"auto", "output-error", "noise-aware"}, optional
        "output-error" takes the force as exact, "noise-aware" as noisy.
    order : {"auto", "full", "damped", "static"}, optional
        What the sampling resolves: the swing of the mass on its bristles, only its slips, or only where it rests;
        "auto" asks the recordings.
    priors : mapping, optional
        What is known beforehand, mean and standard deviation by full name, in SI units: ``{"mass.m": (2.1, 0.2)}``.
    constraints : texts, optional
        What the fit must keep to, in SI units: ``["lugre.fs>=1.05*lugre.fc", "mass.m<=5"]``.
    bootstrap : int, optional
        Number of refits of simulated recordings for the intervals; 0 takes them from the linearised model.
    repeats : bool, optional
        Whether the recordings, two or more, repeat one test. Each is then fitted alone as well, and ``repeats.spreads``
        of the result has the standard deviation between these fits by parameter, in its unit.
    budget : float, optional
        Seconds that the fit may take. When they are over it has not converged, and the values are those so far.
    crosscheck : bool, optional
        Whether spring and friction are compared with those of a sparse regression of the recorded force.
    catalogue : Catalogue, optional
        Where effects are looked up; ``CATALOGUE.extended`` adds your own.
    progress : callable, optional
        ``progress(stage, done, total)``, called now and then; a total of 0 means unknown.

    Returns
    -------
    Identification
        The model with its uncertainties, and its free runs. `values`, `model`, `write`, `report`, `plot`.

    Raises
    ------
    BadInput
        A recording or a parameter cannot be used; repeats of one recording are none.
    NegativeAnswer
        No values came out: the valve does not move, for example.

    >>> import bristle as br
    >>> recording = br.simulate("mixed:10", given={"spring.K": 4e4}, rate=500, position_noise=2e-6, seed=3)
    >>> found = br.fit(recording, crosscheck=False)
    >>> found.converged, round(found.values["spring.K"] / 4e4, 3)
    (True, 1.0)
    """
    _check("causality", causality, (None, *CAUSALITIES))
    _check("estimator", estimator, get_args(Estimator))
    _check("order", order, ORDERS)
    added = tuple(effects)
    for effect in added:
        _check("effects", effect, catalogue.ids)
    held = without_effects(without) | dict(given or {})
    fitted, judging = (with_area(read_all(some), area) for some in (recordings, holdout))
    return identification.identify(
        fitted, holdout=judging, effects=tuple(dict.fromkeys((*BASE, *added))), given=held, causality=causality,
        hold=hold, check=crosscheck, estimator=estimator, order=order, priors=priors,
        constraints=tuple(constraints), bootstrap=bootstrap, repeats=repeats, budget=budget, catalogue=catalogue,
        progress=progress,
    )  # fmt: skip


def trace(
    recordings: RecordingLike | Iterable[RecordingLike],
    *,
    holdout: RecordingLike | Iterable[RecordingLike] = (),
    given: Mapping[str, float] | None = None,
    report_on: RecordingLike | Iterable[RecordingLike] = (),
    without: Iterable[str] = (),
    area: float | None = None,
    hold: bool = False,
    budget: float = float("inf"),
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Trace:
    """Find the effect that a valve shows and the model of friction and spring lacks, or say that nothing is missing.

    Parameters
    ----------
    recordings, given, without, area, hold, progress
        As for `fit`. The roles of the signals say whether the rig imposes the motion:
        ``Recording.from_arrays(..., roles={"position": "input", "force": "output"})``.
    catalogue : Catalogue, optional
        The effects that are tried; ``br.CATALOGUE.extended(MyEffect())`` adds your own.
    holdout : recording, path or ``bundled:NAME``, or several of them
        Recordings that only judge; without any, the last quarter of each recording does.
    report_on : recording, path or ``bundled:NAME``, or several of them
        Recordings for the errors before and after, which neither fit nor judge; without any, the last quarter of what
        is held out.
    budget : float, optional
        Seconds after which the answer is the best so far; ``found.complete`` says whether all was tried. Without one it
        takes as long as it takes; `bristle trace` has 120.

    Returns
    -------
    Trace
        The verdict, every candidate, and the errors before and after. `verdict`, `values`, `model`, `write`, `report`,
        `plot`.

    Raises
    ------
    BadInput, NegativeAnswer
        As for `fit`.

    >>> import bristle as br
    >>> recording = br.simulate("mixed:20", position_noise=3e-6, force_noise=0.1, seed=3)
    >>> br.trace(recording).verdict
    'none'
    """
    held = without_effects(without) | dict(given or {})
    fitted, judging, reporting = (with_area(read_all(some), area) for some in (recordings, holdout, report_on))
    return identification.trace(
        fitted, holdout=judging, report_on=reporting, given=held, hold=hold, budget=budget, catalogue=catalogue,
        progress=progress,
    )  # fmt: skip


def _check(parameter: str, value: object, allowed: tuple[object, ...]) -> None:
    if value not in allowed:
        words = ", ".join(str(one) for one in allowed if one is not None)
        raise BadParameter(parameter, value, "it is not an allowed value", f"use one of {words}")
