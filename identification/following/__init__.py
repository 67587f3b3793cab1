"""A valve through the years: what natural movement says of it, its trends, and when they cross limits."""

from identification.following.followed import FollowedQuantity, FollowedValve, LevelOnDay
from identification.following.limit_crossing import LimitCrossing, crossing
from identification.following.procedure import follow
from identification.following.quantities import UNITS, SeenRecording, SeenValue, seen_in
from identification.following.trend import TrendBelief

__all__ = [
    "UNITS",
    "FollowedQuantity",
    "FollowedValve",
    "LevelOnDay",
    "LimitCrossing",
    "SeenRecording",
    "SeenValue",
    "TrendBelief",
    "crossing",
    "follow",
    "seen_in",
]
