"""The benchmark's performance indices of one run (Syfert et al., *Benchmark Definition*, 2002).

Times are in seconds of the run; a detection decision DD or an isolation decision PID is one truth value per second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recordings import Array, Integers

Truths = NDArray[np.bool_]


@dataclass(frozen=True)
class Zone:
    """ton, tfrom, thor of a scenario [s]: judged from ton on, fault from tfrom on, until thor; tfd, fsmax : how the
    fault grows [s], and how far [1].
    """

    ton: int
    tfrom: int
    thor: int
    tfd: float = 0.0
    fsmax: float = 1.0

    def strength(self, t: float) -> float:
        """Strength of the fault at t [s]."""
        return self.fsmax if self.tfd == 0 else self.fsmax * min(1.0, max(0.0, (t - self.tfrom) / self.tfd))


@dataclass(frozen=True)
class Indices:
    """first : time from tfrom to the first second with a decision [s]; tdt : to the last rising edge, which punishes
    chatter (benchmark); rfd, rtd : share of the fault-free and of the faulty time with a decision; fsd : strength at
    the last rising edge, fs_first at the first; None where there was no decision in the faulty time.

    For isolation the same numbers of PID are the benchmark's tit, rfi, rti and fsi.
    """

    first: float | None
    tdt: float | None
    rfd: float
    rtd: float
    fsd: float | None
    fs_first: float | None

    @property
    def detected(self) -> bool:
        """Whether there was a decision in the faulty time that did not stand from before."""
        return self.first is not None


def indices(decision: Truths, zone: Zone) -> Indices:
    """The indices of a decision (n_seconds,). One that stands at tfrom from before, by a false alarm, is no detection
    of the fault; only an edge after it is.
    """
    healthy, faulty = decision[zone.ton : zone.tfrom], decision[zone.tfrom : zone.thor]
    before = np.concatenate([decision[zone.tfrom - 1 : zone.tfrom], faulty[:-1]])
    edges = np.flatnonzero(faulty & ~before)
    first, last = (float(edges[0]), float(edges[-1])) if len(edges) else (None, None)
    return Indices(
        first, last, float(healthy.mean()) if len(healthy) else 0.0, float(faulty.mean()) if len(faulty) else 0.0,
        None if last is None else zone.strength(zone.tfrom + last),
        None if first is None else zone.strength(zone.tfrom + first),
    )  # fmt: skip


def misisolation(flagged: Integers, zone: Zone) -> float:
    """rmi: mean number of wrong groups flagged from ton to thor, of counts (n_seconds,)."""
    judged: Array = flagged[zone.ton : zone.thor].astype(float)
    return float(judged.mean()) if len(judged) else 0.0


def chance(detected: int, trials: int, share: float) -> float:
    """Probability that a random alarm, which detects with probability `share`, detects as often or oftener.

    >>> round(chance(3, 3, 0.1), 6)
    0.001
    """
    from scipy.stats import binom

    return float(binom.sf(detected - 1, trials, share))
