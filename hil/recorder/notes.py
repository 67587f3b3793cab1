"""Notes for a recording that is being made: what somebody who watches the valve has to say, beside its samples."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

MOST_NOTES = 1000
"""Notes that wait for the disk; then the oldest goes."""


@dataclass(frozen=True, slots=True)
class Note:
    """One note. time : of the sample that it is about, on the source's clock [s]; kind, text : as of an event."""

    time: float
    valve: str
    kind: str
    text: str


class Notes:
    """Between whoever notes and the recorder, which takes what there is with every batch. No side ever waits.

    >>> notes = Notes()
    >>> notes.add(Note(12.5, "LC74_20", "alarm", "the friction has changed"))
    >>> [note.kind for note in notes.take()], notes.take()
    (['alarm'], [])
    """

    def __init__(self) -> None:
        self._waiting: deque[Note] = deque(maxlen=MOST_NOTES)

    def add(self, note: Note) -> None:
        """Note something, at once."""
        self._waiting.append(note)

    def take(self) -> list[Note]:
        """All that waits, oldest first."""
        return [self._waiting.popleft() for _ in range(len(self._waiting))]
