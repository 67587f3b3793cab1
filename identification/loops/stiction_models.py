"""A two-parameter model of a sticking valve: S, dead band plus stick band, and J, slip jump, both in the unit of OP.

Kano, Maruta, Kugemoto and Shimizu (2004), Practical model and detection algorithm for valve stiction, IFAC DYCOPS; the
parameters are those of Choudhury, Thornhill and Shah (2005). With J = 0 it is backlash.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from recordings import Array


@dataclass
class KanoValve:
    """A valve stepped sample by sample: `move(op)` gives its position, in the unit of OP."""

    s: float
    j: float
    position: float = 0.0
    stopped_at: float = 0.0
    before: float = 0.0
    way: float = 1.0
    stopped: bool = True

    def move(self, op: float) -> float:
        """The position for the next controller output."""
        if not self.stopped and (op - self.before) * self.way <= 0:
            self.stopped, self.stopped_at = True, self.before
        if self.stopped:
            away = op - self.stopped_at
            if -self.way * away > self.s:
                self.way, self.stopped = -self.way, False
            elif self.way * away > self.j:
                self.stopped = False
        if not self.stopped:
            self.position = op - self.way * (self.s - self.j) / 2
        self.before = op
        return self.position


def kano(op: Array, s: Array, j: Array, way: float) -> Array:
    """Positions (n, k) of k valves with the parameters s, j (k,) for one controller output (n,).

    way : 1 or -1, the direction in which they have moved before they stopped at the first sample.
    """
    ways, stopped = np.full(len(s), way), np.ones(len(s), bool)
    stopped_at, half, before = np.full(len(s), op[0]), (s - j) / 2, op[0]
    place = op[0] - way * half
    course = np.empty((len(op), len(s)))
    for k, now in enumerate(op):
        turned = ~stopped & (ways * (now - before) <= 0)
        stopped_at = np.where(turned, before, stopped_at)
        stopped = stopped | turned
        along = ways * (now - stopped_at)
        reverses = stopped & (-along > s)
        ways = np.where(reverses, -ways, ways)
        stopped = stopped & ~reverses & ~(along > j)
        place = np.where(stopped, place, now - ways * half)
        before = now
        course[k] = place
    return course
