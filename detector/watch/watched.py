"""A whole recording watched in one call: the same steps as live, and what came of them as one value."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from detector.measurements import Measurements
from detector.watch import pictures
from detector.watch.course import WatchCourse
from detector.watch.judgement import Judgement
from detector.watch.learning import learn
from detector.watch.watch import Watch
from detector.watch.watch_page import WatchedValve, watch_page
from recordings import Array, Progress, Recording, save_text, silent
from simulator import CATALOGUE, Catalogue, ValveModel

REPORTED = 1000
"""Samples from one report of the progress to the next."""


@dataclass(frozen=True)
class Watched:
    """A recording as a detector saw it. judgements : one for each sample, in order; tag : of the valve, empty where
    none is known; learned : in words, how often a false alarm comes.

    >>> Watched(())
    <Watched: 0 samples, 0 alarms>
    """

    judgements: tuple[Judgement, ...]
    tag: str = ""
    learned: str = ""

    @property
    def time_s(self) -> Array:
        """The recording's own time [s], (n_samples,)."""
        return self._column("time_s")

    @property
    def load(self) -> Array:
        """The largest score of all tests, (n_samples,): an alarm above 1, 0 where a sample was skipped."""
        return self._column("load")

    @property
    def residual(self) -> Array:
        """Score of the test that is closest to its limit, (n_samples,)."""
        return self._column("residual")

    @property
    def threshold(self) -> Array:
        """Limit of the same test, (n_samples,)."""
        return self._column("threshold")

    @property
    def alarm(self) -> NDArray[np.bool_]:
        """Whether there is an alarm, (n_samples,)."""
        return np.array([one.alarm for one in self.judgements], bool)

    @property
    def changes(self) -> tuple[Judgement, ...]:
        """The judgements at which an alarm began, ended, or got another kind: what `bristle replay` has events of."""
        return tuple(one for one in self.judgements if one.changed)

    @property
    def alarms(self) -> tuple[Judgement, ...]:
        """The judgements at which an alarm began."""
        return tuple(one for one in self.judgements if one.began)

    def __repr__(self) -> str:
        count = len(self.alarms)
        return f"<Watched: {len(self.judgements)} samples, {count} {'alarm' if count == 1 else 'alarms'}>"

    def _repr_html_(self) -> str:
        return pictures.table(self, repr(self).strip("<>"))

    def plot(self) -> Any:
        """The largest score over time, with its limit and the alarms, as a bokeh figure."""
        return pictures.picture(self)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write one self-contained HTML page, which opens with verdict, confidence and what to do next. Raises BadInput
        when it cannot be written.
        """
        seen = WatchedValve(self.tag, self.learned, WatchCourse.of(self.judgements))
        save_text(Path(path), watch_page([seen]))

    def _column(self, name: str) -> Array:
        return np.array([getattr(one, name) for one in self.judgements], float)


def learn_recordings(
    recordings: Sequence[Recording],
    model: ValveModel | None = None,
    per_month: float = 1.0,
    *,
    catalogue: Catalogue = CATALOGUE,
    progress: Progress = silent,
) -> Watch:
    """The detector of a valve from recordings of it in good order: `learn` on all of them.

    Raises BadInput as `Measurements.joined` and `learn` do.
    """
    return learn(Measurements.joined(recordings), model, per_month, catalogue=catalogue, progress=progress)


def watch_recording(watch: Watch, recording: Recording, progress: Progress = silent) -> Watched:
    """What a detector says of a recording, sample by sample: the same as `bristle replay`, to the last bit.

    Raises BadInput when the recording lacks a signal that the detector was learned with.
    """
    data = Measurements.recorded(recording)
    watch.check(data.values, recording.label)
    state, found = watch.initial(), list[Judgement]()
    for first in range(0, len(data), REPORTED):
        progress("samples", first, len(data))
        state, judged = watch.run(state, data[first : first + REPORTED])
        found += judged
    progress("samples", len(data), len(data))
    return Watched(tuple(found), recording.plant.tag or "", watch.evidence.promise.sentence)
