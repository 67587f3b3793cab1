"""A fault detector for one valve: learned from recordings of it when healthy, and what it sees in another."""

from __future__ import annotations

import os
from collections.abc import Iterable

import detector
from bristle.door.sources import RecordingLike, read, read_all
from detector import Watch, Watched
from recordings import Progress, silent
from simulator import CATALOGUE, Catalogue, ValveModel


def learn(
    recordings: RecordingLike | Iterable[RecordingLike],
    model: ValveModel | str | os.PathLike[str] | None = None,
    *,
    false_alarms: float = 1.0,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Watch:
    """Learn the behaviour of a healthy valve, for `watch`.

    Parameters
    ----------
    recordings : recording, path or ``bundled:NAME``, or several of them
        Of the healthy valve, moving to and fro as in service.
    model : ValveModel or path, optional
        Of `fit` or `trace`. With it the detector can tell friction from spring and sensor.
    false_alarms : float, optional
        False alarms a month that are wished at most. The result says what the recordings support of it.
    catalogue : Catalogue, optional
        Where the model's effects are looked up; ``CATALOGUE.extended`` adds your own.
    progress : callable, optional
        ``progress(stage, done, total)``, called now and then; a total of 0 means unknown.

    Returns
    -------
    Watch
        The detector of this valve.

    Raises
    ------
    BadInput
        The recordings are too short to learn from, the valve hardly moves, a signal is missing, or the
        model has an effect that the catalogue does not have.

    >>> import bristle as br
    >>> healthy = br.simulate("sine:60,mixed:60", rate=50, position_noise=5e-6, seed=3)
    >>> found = br.learn(healthy, false_alarms=1000.0)
    >>> br.watch(healthy, found)
    <Watched: 6001 samples, 0 alarms>
    """
    known = model if model is None or isinstance(model, ValveModel) else ValveModel.read(model, catalogue)
    return detector.learn_recordings(read_all(recordings), known, false_alarms, catalogue=catalogue, progress=progress)


def watch(recording: RecordingLike, detector_of_valve: Watch, *, progress: Progress = silent) -> Watched:
    """Watch a recording with a detector of its valve: the same steps, sample by sample, as on a live valve.

    Parameters
    ----------
    recording : recording, path or ``bundled:NAME``
        With the signals that the detector was learned with.
    detector_of_valve : Watch
        What `learn` gave.
    progress : callable, optional
        ``progress(stage, done, total)``, called every thousand samples.

    Returns
    -------
    Watched
        Over time: ``load`` (largest score relative to its limit; above 1 raises an alarm), ``residual``, ``threshold``,
        ``alarm``; and what happened: ``changes``, ``alarms``. `report`, `plot`.

    Raises
    ------
    BadInput
        A signal is missing that the detector was learned with.

    >>> import bristle as br
    >>> model = br.fit(br.simulate("mixed:10", position_noise=2e-6, seed=3), crosscheck=False).model
    >>> healthy = br.simulate("mixed:60", rate=50, position_noise=5e-6, seed=3)
    >>> found = br.learn(healthy, model, false_alarms=1000.0)
    >>> more = {"lugre.fc": 1.5 * model.values["lugre.fc"], "lugre.fs": 1.5 * model.values["lugre.fs"]}
    >>> worn = br.simulate("mixed:20", given=more, rate=50, position_noise=5e-6, seed=3)
    >>> len(br.watch(healthy, found).alarms), len(br.watch(worn, found).alarms) > 0
    (0, True)
    """
    return detector.watch_recording(detector_of_valve, read(recording), progress)
