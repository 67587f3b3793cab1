"""Alarms at a rate that holds: evidence against what was learned, and what the learned time supports."""

from detector.alarms.learning import learn_evidence
from detector.alarms.promise import MONTH_S, Promise
from detector.alarms.service import Evidence, EvidenceState

__all__ = ["MONTH_S", "Evidence", "EvidenceState", "Promise", "learn_evidence"]
