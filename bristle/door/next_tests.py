"""The experiment that would tell: `bristle next-test` as a call."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from identification import Trace
from identification.next_test import DRIVES, DesignBounds, NextTest, models_of, models_of_trace
from identification.next_test import next_test as designed
from recordings import BadInput, BadParameter, Progress, silent
from simulator import CATALOGUE, Catalogue, ValveModel

Suspect = ValveModel | Trace | str | os.PathLike[str]
"""A model, a trace, or the file of either."""


def next_test(
    models: Suspect | Iterable[Suspect],
    *,
    travel: tuple[float, float] = (10.0, 90.0),
    rate: float = 50.0,
    pressure: tuple[float, float] | None = None,
    duration: float = 60.0,
    drive: str | None = None,
    sampling: float = 100.0,
    stroke: float | None = None,
    area: float | None = None,
    bends: int = 12,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> NextTest:
    """Find the test that tells most: between models that recordings could not tell apart, or of weak parameters.

    Parameters
    ----------
    models : ValveModel, Trace, path of ``model.json`` or ``trace.json``, or several of them
        Several models are rivals. A trace has the rivals that it could not separate. Of a single model the weak
        parameters are looked after, or all where none is weak.
    travel : pair of floats, optional
        Where the stem may go, lowest and highest position in % of the stroke.
    rate : float, optional
        Fastest change, in % of the stroke in a second.
    pressure : pair of floats, optional
        Lowest and highest pressure [kPa].
    duration : float, optional
        Length of the test [s].
    drive : {"force", "pressure", "setpoint"}, optional
        What the sequence asks; by default the pressure where the diaphragm's area is known, else the force.
    sampling : float, optional
        Samples a second of sequence and recording [Hz].
    stroke, area : float, optional
        Stroke [m] and area of the diaphragm [m2], where a model does not say them.
    bends : int, optional
        Trials by which each of the best families of sequences is bent.
    catalogue : Catalogue, optional
        Where effects are looked up.
    progress : callable, optional
        ``progress(stage, done, total)``, called now and then.

    Returns
    -------
    NextTest
        ``sequence`` over ``t``, ``expected`` intervals and distances, ``settles``. `write`, `report`.

    Raises
    ------
    BadInput
        A model or a limit cannot be used.
    NegativeAnswer
        No sequence keeps the limits.

    >>> import bristle as br
    >>> recording = br.simulate("sine:5", given={"spring.K": 4e4}, rate=100, position_noise=5e-6, seed=3)
    >>> found = br.fit(recording, crosscheck=False)
    >>> proposed = br.next_test(found.model, duration=5, bends=4)
    >>> proposed.t[-1], proposed.column
    (np.float64(5.0), 'force_N')
    """
    if drive is not None and drive not in DRIVES:
        raise BadParameter("drive", drive, "there is no such drive", f"use {', '.join(DRIVES)}")
    bounds = DesignBounds((travel[0], travel[1]), rate, pressure, duration)
    given = {"stroke_m": _positive("stroke", stroke), "diaphragm_area_m2": _positive("area", area)}
    known = {name: value for name, value in given.items() if value is not None}
    sources = [models] if isinstance(models, ValveModel | Trace | str | os.PathLike) else list(models)
    rivals = _named(sources, catalogue)
    rivals = {name: model.model_copy(update={"plant": {**model.plant, **known}}) for name, model in rivals.items()}
    chosen = next((each for each in DRIVES if each == drive), None)
    return designed(
        rivals, bounds, drive=chosen, sampling=sampling, bends=bends, catalogue=catalogue, progress=progress
    )  # fmt: skip


def _named(sources: list[Suspect], catalogue: Catalogue) -> Mapping[str, ValveModel]:
    """The models by names that differ."""
    found: dict[str, ValveModel] = {}
    for number, source in enumerate(sources, 1):
        if isinstance(source, Trace):
            some = models_of_trace(source.as_json(), source.catalogue)
        elif isinstance(source, ValveModel):
            some = {f"model {number}" if len(sources) > 1 else "model": source}
        else:
            some = models_of(Path(source), catalogue)
        for name, model in some.items():
            found[name if name not in found else f"{name} ({number})"] = model
    if not found:
        raise BadInput("models", "there are none", "give a model.json or a trace.json")
    return found


def _positive(name: str, value: float | None) -> float | None:
    if value is not None and not 0 < value < float("inf"):
        raise BadParameter(name, f"{value:g}", "it is not a positive number", "give a positive number")
    return value
