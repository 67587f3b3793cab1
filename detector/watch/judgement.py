"""What the detector says of one measurement."""

from __future__ import annotations

from dataclasses import dataclass

from detector.observer.screening import SampleVerdict

KINDS = ("friction", "spring", "sensor", "supply", "flow")
"""What an alarm can be named; None stands for an unknown kind."""

AT_THE_FLOW = ("sensor", "flow")
"""What both the flow and the balance of forces feel, until the stem has moved enough to tell them apart."""

ALONG_STROKE = ("spring", "sensor")
"""What a force along the stroke comes from, unless the friction says that it is the spring: spring and diaphragm, or
the sensor of force or pressure.
"""


@dataclass(frozen=True)
class Judgement:
    """What the detector says of one measurement.

    time_s [s] : of the measurement; alarm : whether there is an alarm now; began, ended, renamed : what happened to it
    here; kind : one of `KINDS`, or None; test : the one closest to its limit; residual, threshold : its score and
    limit; load : the largest of all scores, 1 at the limit; verdict : on the measurement; gap_s : the silence before it
    [s], 0 where there was none; remaining : without a kind, those that the evidence leaves, where they are few.
    """

    time_s: float
    alarm: bool
    began: bool
    ended: bool
    renamed: bool
    kind: str | None
    test: str
    residual: float
    threshold: float
    load: float
    verdict: SampleVerdict
    gap_s: float = 0.0
    remaining: tuple[str, ...] = ()

    @property
    def changed(self) -> bool:
        """Whether an alarm began, ended, or got another kind here."""
        return self.began or self.ended or self.renamed
