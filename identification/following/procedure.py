"""From dated recordings of one valve to what became of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from itertools import pairwise

import numpy as np

from identification.following.followed import FollowedQuantity, FollowedValve, LevelOnDay
from identification.following.limit_crossing import crossing
from identification.following.quantities import UNITS, SeenRecording, SeenValue, seen_in
from identification.following.trend import INTERVAL, TrendBelief
from recordings import BadInput, BadParameter, NegativeAnswer, Progress, Recording, silent, tracked

DAY = 86400.0
DRAWN, SEED = 4000, 21


def follow(
    recordings: Sequence[Recording], limits: Mapping[str, float] | None = None, progress: Progress = silent
) -> FollowedValve:
    """Friction, spring rate, dead band and leak of a valve over dated recordings, their trends, and when they cross
    limits by name, in the unit of `UNITS`.

    Raises BadInput for recordings without a date or of one moment, BadParameter for a limit that there is not,
    NegativeAnswer where no quantity shows in two recordings.
    """
    wrong = next((name for name in limits or {} if name not in UNITS), None)
    if wrong is not None:
        raise BadParameter("limit", wrong, "it is not followed", f"there are {', '.join(UNITS)}")
    seen = sorted((seen_in(one) for one in tracked(recordings, "recordings", progress)), key=lambda one: one.date)
    again = next((b for a, b in pairwise(seen) if a.date == b.date), None)
    if again is not None:
        raise BadInput(again.label, f"it has the date of another recording, {again.date.isoformat()}", "give each once")
    found = [_followed(name, seen, (limits or {}).get(name)) for name in UNITS]
    quantities = {one.name: one for one in found if one is not None}
    if not quantities:
        reasons = dict.fromkeys(why for one in seen for why in one.missing.values())
        raise NegativeAnswer(f"no quantity shows in two recordings: {next(iter(reasons), 'there are too few')}")
    unseen = [f"{name}: it does not show in two recordings" for name in limits or {} if name not in quantities]
    return FollowedValve(quantities, tuple(one.label for one in seen), tuple(unseen))


def _followed(name: str, seen: Sequence[SeenRecording], limit: float | None) -> FollowedQuantity | None:
    """A quantity through the recordings that show it; None where fewer than two do."""
    shown = [(one.date, one.values[name]) for one in seen if name in one.values]
    if len(shown) < 2:
        return None
    start, belief, levels = shown[0][0], None, []
    for date, value in shown:
        belief = _updated(belief, (date - start).total_seconds() / DAY, value)
        levels.append(_level(date, value, belief))
    assert belief is not None
    trend = np.quantile(belief.drawn(DRAWN, np.random.default_rng(SEED))[1], (0.5, *INTERVAL))
    met = None if limit is None else crossing(belief, limit, shown[0][1].value)
    return FollowedQuantity(name, UNITS[name], tuple(levels), (float(trend[0]), float(trend[1]), float(trend[2])), met)


def _updated(belief: TrendBelief | None, day: float, seen: SeenValue) -> TrendBelief:
    if belief is None:
        return TrendBelief.first(day, seen.value, seen.std)
    return belief.seen(day, seen.value, seen.std)


def _level(date: datetime, seen: SeenValue, belief: TrendBelief) -> LevelOnDay:
    level = np.quantile(belief.drawn(DRAWN, np.random.default_rng(SEED))[0], (0.5, *INTERVAL))
    return LevelOnDay(date, seen.value, seen.std, float(level[0]), float(level[1]), float(level[2]))
