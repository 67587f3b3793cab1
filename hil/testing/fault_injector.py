"""What goes wrong on a line, on purpose and counted: replies in, what a client gets to see out. No socket, no clock.

At most one fault befalls a reply, drawn by its probability from a seeded generator: the same seed and the same replies
give the same faults.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from random import Random
from types import MappingProxyType
from typing import Any

from hil.testing.fault_modes import FAULTS, MODES, Action, Case, Mode, Send
from hil.testing.frame_cutter import Framing
from recordings import BadParameter

NETWORK_ONLY: frozenset[Mode] = frozenset({"wrong_transaction", "close"})
"""What a serial line has no counterpart of."""


@dataclass(frozen=True)
class FaultSchedule:
    """How often what happens to a reply.

    probability : per reply, by mode; their sum is at most 1. delay_s : how late a delayed reply is [s]; jitter_s : at
    most how late a jittering one [s]; drip_s : pause between the bytes of a dripping one [s]; silence : how many
    replies in a row a silence swallows.

    Raises BadParameter for an unknown mode or impossible probabilities.
    """

    probability: Mapping[Mode, float]
    seed: int = 0
    delay_s: float = 0.2
    jitter_s: float = 0.01
    drip_s: float = 0.001
    silence: int = 5

    def __post_init__(self) -> None:
        unknown = sorted(set(self.probability) - set(MODES))
        if unknown:
            raise BadParameter("probability", unknown[0], "there is no such fault", f"there are {', '.join(MODES)}")
        if min(self.probability.values(), default=0.0) < 0.0 or sum(self.probability.values()) > 1.0 + 1e-9:
            found = f"they are {', '.join(f'{p:g}' for p in self.probability.values())}"
            raise BadParameter("probability", "", found, "each is at least 0, and all together are at most 1")
        object.__setattr__(self, "probability", MappingProxyType(dict(self.probability)))

    @classmethod
    def even(cls, share: float, *modes: Mode, **others: Any) -> FaultSchedule:
        """Every given mode equally often, all together in `share` of the replies.

        >>> dict(FaultSchedule.even(0.5, "drop", "close").probability)
        {'drop': 0.25, 'close': 0.25}
        """
        return cls({mode: share / len(modes) for mode in modes}, **others)


@dataclass
class FaultInjector:
    """Decides, reply by reply, what a client gets to see.

    replies : how many came from the server; counts : how many of them were tampered with, by mode.
    """

    schedule: FaultSchedule
    framing: Framing
    replies: int = 0
    counts: Counter[Mode] = field(default_factory=Counter)
    _swallow: int = field(default=0, init=False, repr=False)
    _random: Random = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.follow(self.schedule)

    def follow(self, schedule: FaultSchedule) -> None:
        """Go by another schedule from the next reply on. Raises BadParameter for what this line cannot have."""
        impossible = sorted(NETWORK_ONLY & set(schedule.probability)) if self.framing == "rtu" else []
        if impossible:
            raise BadParameter("schedule", impossible[0], "a serial line has no such fault", "leave it out")
        self.schedule, self._random, self._swallow = schedule, Random(schedule.seed), 0

    def reply(self, frame: bytes) -> list[Action]:
        """What becomes of one whole reply frame of the server, in order.

        >>> FaultInjector(FaultSchedule({"drop": 1.0}), "tcp").reply(bytes.fromhex("0001 0000 0003 01 83 02"))
        []
        """
        self.replies += 1
        mode = "silence" if self._swallow else self._draw()
        if mode is None:
            return [Send(frame)]
        self.counts[mode] += 1
        if mode == "silence":
            self._swallow = (self._swallow or self.schedule.silence) - 1
        s = self.schedule
        return FAULTS[mode](Case(frame, self.framing, self._random, s.delay_s, s.jitter_s, s.drip_s))

    def _draw(self) -> Mode | None:
        chance = self._random.random()
        for mode, probability in self.schedule.probability.items():
            chance -= probability
            if chance < 0.0:
                return mode
        return None
