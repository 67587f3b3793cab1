"""Two-parameter models of a sticking valve: S, dead band plus stick band, and J, slip jump, both in the unit of OP.

A valve rests until OP is further than (S + J) / 2 from its place, and then follows OP at a distance of (S - J) / 2: the
static and the sliding friction, on the scale of OP. The models differ in when the valve rests again:

- Kano, Maruta, Kugemoto and Shimizu (2004), Practical model and detection algorithm for valve stiction, IFAC DYCOPS:
  where OP turns. That of Choudhury, Thornhill and Shah (2005) is the same while OP changes from sample to sample.
- He, Wang, Pottmann and Qin (2007), A curve fitting method for detecting valve stiction in oscillating control loops,
  Ind. Eng. Chem. Res. 46, 4549-4560: after every sample, as a stem does that comes to rest before OP changes again.

With J = 0 both are backlash.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from types import ModuleType

import numpy as np

from recordings import Array
from simulator import native_module

MOVES_UP, MOVES_DOWN = 2.0, -2.0
"""Starts of a valve that moves at the first sample."""


@dataclass
class StickingValve:
    """A valve stepped sample by sample: `move(op)` gives its place, in the unit of OP. rests : after every sample, as
    in He's model, else where OP turns, as in Kano's.
    """

    s: float
    j: float
    rests: bool = False
    place: float = 0.0
    _way: float = field(default=0.0, repr=False)
    _before: float = field(default=0.0, repr=False)

    def move(self, op: float) -> float:
        """The place for the next controller output."""
        if self.rests or (op - self._before) * self._way <= 0:
            self._way = 0.0
        if self._way == 0.0 and abs(op - self.place) > (self.s + self.j) / 2:
            self._way = 1.0 if op > self.place else -1.0
        if self._way != 0.0:
            self.place = op - self._way * (self.s - self.j) / 2
        self._before = op
        return self.place


def sticking(op: Array, s: Array, j: Array, start: Array, rests: bool) -> Array:
    """Places (k, n) of k valves with the parameters s, j (k,) for one controller output (n,).

    start (k,) : where the valve rests at the first sample, between -1, where it is about to move up, and 1, about to
    move down; `MOVES_UP` or `MOVES_DOWN` for one that moves.
    """
    op = np.ascontiguousarray(op, float)
    static, sliding, way = (s + j) / 2, (s - j) / 2, np.where(np.abs(start) > 1, np.sign(start), 0.0)
    first = op[0] + np.where(way == 0, start * static, -way * sliding)
    return np.asarray(_loop().places(op, static, sliding, first, way, rests), float)


@cache
def _loop() -> ModuleType:
    return native_module("sticking", files(__package__).joinpath("loop.py").read_text(encoding="utf-8"))
