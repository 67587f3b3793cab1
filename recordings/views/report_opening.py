"""What every report opens with: a verdict in one word, why, how sure it is, and what to do next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

OpeningWord = Literal["good", "watch", "repair"]

_MOODS: Mapping[OpeningWord, str] = {"good": "good", "watch": "warn", "repair": "bad"}
_SHAPES: Mapping[OpeningWord, str] = {"good": "●", "watch": "▲", "repair": "■"}


@dataclass(frozen=True)
class ReportOpening:
    """word : good (nothing to do), watch (look at it again, or measure more) or repair (plan work on the valve); why :
    in a sentence; sure : how sure it is and by what; action : what to do next.
    """

    word: OpeningWord
    why: str
    sure: str
    action: str

    @property
    def mood(self) -> str:
        """The colour of its block."""
        return _MOODS[self.word]

    @property
    def shape(self) -> str:
        """A sign that tells the words apart without colour."""
        return _SHAPES[self.word]
