"""`compare`: what changed between two recordings, or two models, of one valve."""

from __future__ import annotations

import os
from pathlib import Path

from bristle.door.sources import RecordingLike, read
from identification import ValveComparison, compare_models, compare_recordings, experiment, with_area
from recordings import BadInput, BadParameter, Progress, Recording, silent
from simulator import ValveModel

Comparable = RecordingLike | ValveModel
"""A recording or a model, or the file of either."""


def compare(
    before: Comparable,
    after: Comparable,
    *,
    area: float | None = None,
    repeatability: float = 0.0,
    progress: Progress = silent,
) -> ValveComparison:
    """Find what changed between two recordings, or two models, of one valve, beyond noise and repeatability.

    Parameters
    ----------
    before, after : recording, model, path or ``bundled:NAME``
        Two recordings of the same kind of test, with at least two strokes each way (an ordinary step test of five
        strokes is enough), or two models (``model.json``).
    area : float, optional
        Diaphragm area [m2], where recordings have a pressure and do not say the area.
    repeatability : float, optional
        Share by which friction, spring rate and preload differ from test to test of a valve that has not changed, as a
        standard deviation: 0.03 for 3 %. It comes on top of what strokes of one test differ by.
    progress : callable, optional
        Told the stages of the work, once the input can be used.

    Returns
    -------
    ValveComparison
        `changed`, `quantities`, `places`, `sentences`, `write`, `report`.

    Raises
    ------
    BadInput
        For files that cannot be read, a recording beside a model, or a repeatability below 0 or above 1.
    NegativeAnswer
        When strokes or common travel are too few to tell.

    >>> import bristle as br
    >>> found = br.compare("bundled:mixed", "bundled:step")
    >>> found.changed, found.sentences()[0]
    ((), 'Nothing changed beyond noise and repeatability.')
    """
    if not 0.0 <= repeatability < 1.0:
        raise BadParameter("repeatability", repeatability, "it is not a share", "give for example 0.03")
    one, other = _content(before), _content(after)
    if isinstance(one, ValveModel) and isinstance(other, ValveModel):
        return compare_models(one, other, (_name(before), _name(after)), repeatability)
    if isinstance(one, ValveModel) or isinstance(other, ValveModel):
        found = f"{_name(before)} and {_name(after)}"
        raise BadInput(found, "one is a model and one a recording", "compare two of a kind; 'bristle fit' makes models")
    first, last = (experiment(r) for r in with_area([one, other], area))
    progress("comparing stroke by stroke", 0, 0)
    return compare_recordings(first, last, repeatability)


def _content(given: Comparable) -> ValveModel | Recording:
    if isinstance(given, str | os.PathLike) and Path(given).suffix == ".json":
        return ValveModel.read(Path(given))
    return given if isinstance(given, ValveModel) else read(given)


def _name(given: Comparable) -> str:
    return Path(given).name if isinstance(given, str | os.PathLike) else "model"
