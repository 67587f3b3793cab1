"""A valve through the years: `bristle follow` as a call."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from bristle.door.sources import RecordingLike, read
from identification import with_area
from identification.following import FollowedValve
from identification.following import follow as followed
from recordings import BUNDLED, BadInput, Progress, Recording, silent


def follow(
    recordings: RecordingLike | Iterable[RecordingLike],
    *,
    limits: Mapping[str, float] | None = None,
    area: float | None = None,
    progress: Progress = silent,
) -> FollowedValve:
    """Follow friction, spring rate, dead band and leak of a valve over recordings of its natural movement.

    Parameters
    ----------
    recordings : recordings, paths, or a folder of recordings (.h5)
        Each with its date, at the beginning of the file's name (``2026-11-21_valve.h5``) or in the file.
    limits : mapping, optional
        Limits by quantity: ``fc`` [N], ``K`` [N/m], ``dead_band`` [% of the input], ``leak`` [% of the largest flow].
    area : float, optional
        Area of the diaphragm [m2], to turn pressure into force.
    progress : callable, optional
        ``progress(stage, done, total)``, called now and then.

    Returns
    -------
    FollowedValve
        ``quantities`` with their levels, trends and dates of crossing, and 95 % intervals. `write`, `report`.

    Raises
    ------
    BadInput
        A recording has no date, or cannot be read.
    NegativeAnswer
        No quantity shows in two recordings: the stem hardly moves, for example.

    >>> import bristle as br
    >>> from dataclasses import replace
    >>> from datetime import UTC, datetime
    >>> months = [(1, 100.0), (2, 104.0), (3, 108.0)]
    >>> seen = [br.simulate("sine:10", given={"lugre.fc": fc}, rate=50, seed=2) for _, fc in months]
    >>> dated = [replace(r, created=datetime(2026, m, 1, tzinfo=UTC)) for r, (m, _) in zip(seen, months)]
    >>> found = br.follow(dated, limits={"fc": 150.0})
    >>> sorted(found.quantities)
    ['K', 'fc']
    """
    return followed(with_area([_dated(one) for one in _every(recordings)], area), limits, progress)


def _every(recordings: RecordingLike | Iterable[RecordingLike]) -> list[RecordingLike]:
    """The recordings, those of a folder in its place."""
    sources = [recordings] if isinstance(recordings, Recording | str | os.PathLike) else list(recordings)
    found: list[RecordingLike] = []
    for source in sources:
        folder = None if isinstance(source, Recording) or str(source).startswith(BUNDLED) else Path(source)
        if folder is None or not folder.is_dir():
            found.append(source)
            continue
        inside = sorted(folder.glob("*.h5"))
        if not inside:
            raise BadInput(str(folder), "there is no recording (.h5) in it", "'bristle import' makes recordings")
        found += inside
    return found


def _dated(source: RecordingLike) -> Recording:
    """A recording with its date: that at the beginning of its file's name, which someone gave it on purpose, or the
    one in the file, which may be that of its import."""
    recording = read(source)
    begins = re.match(r"\d{4}-\d{2}-\d{2}(T\d{2}-?\d{2})?", recording.path.name if recording.path else "")
    try:
        date = datetime.fromisoformat(begins.group(0)) if begins else None
    except ValueError:
        date = None
    return recording if date is None else replace(recording, created=date.replace(tzinfo=UTC))
