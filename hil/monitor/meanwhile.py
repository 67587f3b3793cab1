"""What can be judged of a valve at once, while its detector is still being learned: by its model alone, and the rate.

It makes no events and no alarms: who learns says that the valve is in good order. It says what it sees.
"""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np

from detector import ADVICE, Measurement, Measurements, Promise, Watch, WatchState
from recordings import BadInput

Starter = Callable[[float, Collection[str]], Watch]
"""Makes a detector without learning, for a sampling time [s] and the signals that come. Raises BadInput where it
cannot."""

SAMPLES = 20
"""So many tell the sampling time."""


class Meanwhile:
    """starter : None where there is no model; wish_s : time between false alarms that is wished [s]."""

    def __init__(self, starter: Starter | None = None, wish_s: float = 0.0) -> None:
        self._starter, self._wish_s = starter, wish_s
        self._watch: Watch | None = None
        self._state: WatchState | None = None
        self._refused = ""
        self.load, self.fault, self.alarmed = 0.0, "", ""

    def due(self, samples: int) -> bool:
        """Whether to `begin` now, with so many samples gathered."""
        return self._starter is not None and samples == SAMPLES

    def begin(self, data: Measurements) -> None:
        """Make the detector for signals and sampling time of what was gathered so far."""
        if self._starter is None:
            return
        there = [name for name in data.values if name in data]
        try:
            self._watch = self._starter(float(np.median(np.diff(data.time_s))), there)
        except BadInput as refusal:
            self._refused = refusal.found
            return
        self._state = self._watch.initial()

    def check(self, moment: Measurement) -> None:
        """The next measurement."""
        if self._watch is None or self._state is None:
            return
        self._state, judgement = self._watch.step(self._state, moment)
        if judgement.verdict.used:
            self.load = judgement.load
        self.fault = ADVICE[judgement.kind].reason if judgement.alarm else ""
        self.alarmed = self.fault or self.alarmed

    @property
    def judged(self) -> str:
        """What is judged already, and what came of it."""
        if self._watch is None:
            why = f": {self._refused}" if self._refused else ""
            return f"link and values are judged, nothing by the model alone{why}"
        seen = self.fault or f"as usual, {100.0 * self.load:.0f} % of the limit"
        return f"link, values, and by the model alone the forces are judged: {seen}"

    def supported(self, gathered_s: float) -> str:
        """What so many seconds would promise."""
        if not self._wish_s or not gathered_s:
            return ""
        return Promise.of(gathered_s, self._wish_s).sentence.partition(";")[0]

    @property
    def doubt(self) -> str:
        """What to say of a detector that was learned meanwhile; empty where nothing was seen."""
        said = f"while it was learned, its model alone said: {self.alarmed}; learn anew if that was no mistake"
        return said if self.alarmed else ""
