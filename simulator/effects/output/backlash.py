"""Play between stem and position sensor (equation 2.36)."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from recordings import Array
from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, travel
from simulator.imitation import usual_damping
from simulator.play import play

SHARES = (0.002, 0.004, 0.007, 0.012, 0.02, 0.03, 0.05)
"""Widths of a play as shares of the travel, for a first guess."""
MOST = 0.9
"""Share of Coulomb friction that a play has put there at most."""
LONGEST, AFTER = 3.0, 0.1
"""How long before the reading moves again a reversal is looked at, and how long after it [s]."""
MANY = 100
"""Reversals that are looked at: those of the longest silence, for noise makes thousands of short ones."""


class PositionBacklash(Effect):
    """y -> w, which the stem drags along at either end of a gap: (2.36) with m = 1 and crossings cr = -cl = width/2."""

    id = "backlash"
    site = Site.OUTPUT
    sentence = "there is play between stem and position sensor, so the reading stands still after a reversal"
    check = "feedback linkage, pins and couplings between stem and position sensor for play"
    imitated = True
    parameters = (Parameter("width", "m", "width of the play", scale=2e-4, lower=0.0, neutral=0.0),)
    memory = (Memory("w", "m", at_position=True),)

    def jump(self, q: Quantities, p: Values, s: Values) -> Mapping[str, Expression]:
        return {"w": play(s["w"], q.y, p["width"])}

    def output(self, q: Quantities, p: Values, s: Values) -> Expression:
        return s["w"]

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """How long the reading stands still after reversals, and how fast it then starts: the width with which a stem
        on Coulomb friction, which first has to cross the play, tells that best.

        A model without the play has half of its width, times the spring constant, in its friction: the loop of force
        over reading is as wide. It also hides the bristles: they look stiffer, and the friction curve flatter.
        """
        K, fc, sigma0 = base["spring.K"], base["lugre.fc"], base["lugre.sigma0"]
        if K <= 0:
            return []
        low, high = travel(recordings)
        some = np.array([0.0, *SHARES]) * (high - low)
        widths = some[some * K < 2 * MOST * fc]
        silences = itertools.chain.from_iterable(map(_silences, recordings))
        longest = heapq.nlargest(MANY, silences, key=lambda one: one.dt * len(one.x))
        width = float(widths[np.argmin(_off(longest, widths, base))]) if longest else 0.0
        if width == 0.0:
            return []
        return [
            self.named(width=width) | {
                "lugre.fc": fc - width * K / 2, "lugre.fs": 1.4 * fc, "lugre.vs": 3e-3,
                "lugre.sigma0": softer * sigma0, "lugre.sigma1": usual_damping(softer * sigma0, base["mass.m"]),
            }
            for softer in (1.0, 0.1)
        ]  # fmt: skip


class StillReading(NamedTuple):
    """A reversal in which the reading rests: time step [s], reading [m] and force [N] (n,), the velocity before [m/s],
    and the direction in which it moved."""

    dt: float
    x: Array
    u: Array
    v: float
    way: float


def _silences(look: FirstLook) -> Iterator[StillReading]:
    """The reversals of a recording, each until shortly after the reading moves again."""
    moving = np.flatnonzero(look.moves)
    turns = np.flatnonzero(np.sign(look.v[moving[1:]]) != np.sign(look.v[moving[:-1]]))
    dt = float(np.median(np.diff(look.t)))
    for before, after in zip(moving[turns], moving[turns + 1], strict=True):
        first = max(before, after - round(LONGEST / dt))
        part = slice(first, after + round(AFTER / dt))
        yield StillReading(dt, look.x[part], look.u[part], float(look.v[first]), float(np.sign(look.v[before])))


def _off(silences: Sequence[StillReading], widths: Array, base: Mapping[str, float]) -> Array:
    """How far a reading behind each width of a play (k,) is off in some reversals, the sum of their means [m]."""
    K, fc, m, sigma0 = (base[name] for name in ("spring.K", "lugre.fc", "mass.m", "lugre.sigma0"))
    seen, force, share = _side_by_side(silences)
    h, first, way = (np.array([[getattr(one, name)] for one in silences]) for name in ("dt", "v", "way"))
    x, v, bent = seen[0] + way * widths / 2, first + 0 * widths, way + 0 * widths
    y, off = seen[0] + 0 * widths, np.zeros(len(widths))
    for x_seen, u, counts in zip(seen, force, share, strict=True):
        level = fc - K * widths / 2 + (base["lugre.fs"] - fc) * np.exp(-((v / base["lugre.vs"]) ** 2))
        missing = u - K * x - base["spring.F0"] - level * bent
        left = 1 - bent * np.sign(missing)
        damping = base["lugre.sigma2"] + left * (base["lugre.sigma1"] + h * sigma0)
        v = (m * v + h * missing) / (m + h * damping)
        bent = np.clip(bent + left * sigma0 / level * h * v, -1.0, 1.0)
        x = x + h * v
        y = np.clip(y, x - widths / 2, x + widths / 2)
        off += (counts * np.abs(y - x_seen)).sum(axis=0)
    return off


def _side_by_side(silences: Sequence[StillReading]) -> tuple[Array, Array, Array]:
    """Readings and forces of reversals, and what each sample counts in the mean over its own: nothing behind its end,
    (n, n_silences, 1) each.
    """
    n = max(len(one.x) for one in silences)
    x, u = (
        np.stack([np.pad(getattr(one, name), (0, n - len(one.x)), "edge") for one in silences], axis=1)
        for name in ("x", "u")
    )
    lengths = np.array([len(one.x) for one in silences])
    counts = (np.arange(n)[:, None] < lengths) / lengths
    return x[..., None], u[..., None], counts[..., None]
