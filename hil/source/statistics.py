"""How well a source keeps up: counts, rates and lateness, in memory that does not grow."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from hil.plant.pace import Lateness


@dataclass
class Statistics:
    """What a source has done so far.

    samples : yielded; polls : rounds begun; missed : deadlines passed over; lateness : of the rounds against their
    deadlines; faults : requests and frames that were refused, by their reason; failures : what the recorder or the
    monitor of the source could not do and went on without, by its words.
    """

    samples: int = 0
    polls: int = 0
    missed: int = 0
    lateness: Lateness = field(default_factory=Lateness)
    faults: Counter[str] = field(default_factory=Counter)
    failures: Counter[str] = field(default_factory=Counter)
