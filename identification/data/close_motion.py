"""The motion of a recording as closely as its samples show it, for a force that is to be predicted from it.

A bristle answers to every micrometre, so what smoothing leaves of the noise, or blurs of a slip, returns in the
predicted force. The position is taken for some integrals of white noise whose intensity differs along the recording
(`force.py`): a rest is smoothed over a long time and a slip over few samples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from identification.data.experiment import Experiment, Segment, imposed
from identification.data.force import ORDER, SMOOTH, chain, smoothed
from identification.data.smoothing import Motion
from recordings import Array


@dataclass(frozen=True)
class MotionSmoother:
    """The likeliest smoother of one position. t (n,) [s]; noise [m] of the samples; order : number of integrals;
    intensity (n - 1,) : of the noise that drives them.
    """

    t: Array
    noise: float
    order: int
    intensity: Array

    @classmethod
    def of(cls, t: Array, y: Array, noise: float) -> MotionSmoother:
        """The smoother for positions y (n,) [m] at t (n,) [s], with noise of that standard deviation [m]."""
        found = [(order, *chain(t, y, noise, order, moving=True)[2:]) for order in (ORDER, SMOOTH)]
        order, intensity, _ = max(found, key=lambda one: one[2])
        return cls(t, noise, order, intensity)

    def motion(self, y: Array) -> Motion:
        """The motion that it makes of positions y (n,) [m]. Nothing creeps in it that has to be kept out."""
        mean = smoothed(self.t, y, self.intensity, self.noise, self.order)
        x, v = mean[:, 0].copy(), mean[:, 1].copy()
        a = np.gradient(v, self.t) if self.order == ORDER else mean[:, 2].copy()
        return Motion(x, v, a, v)


def closely_imposed(e: Experiment) -> Experiment:
    """The experiment with its motion imposed, as closely as it is known."""
    return _with_motions(e, lambda s: _smoother(e, s).motion(s.y))


def disturbed(e: Experiment, draws: int, rng: np.random.Generator) -> Iterator[Experiment]:
    """The same with as much noise again in the position, so many times."""
    smoothers = [_smoother(e, s) for s in e.segments]
    for _ in range(draws):
        noisy = [s.y + rng.normal(0.0, e.noise_position, len(s.y)) for s in e.segments]
        motions = iter([one.motion(y) for one, y in zip(smoothers, noisy, strict=True)])
        yield _with_motions(e, lambda _: next(motions))  # noqa: B023 - used up at once


def thinned(e: Experiment) -> Experiment:
    """The same known from every other sample: how much that changes tells what all samples may still miss."""
    return _with_motions(e, lambda s: _thinned(e, s))


def _smoother(e: Experiment, s: Segment) -> MotionSmoother:
    return MotionSmoother.of(s.t, s.y, e.noise_position)


def _thinned(e: Experiment, s: Segment) -> Motion:
    t, y = (np.ascontiguousarray(z[::2]) for z in (s.t, s.y))
    m = MotionSmoother.of(t, y, e.noise_position).motion(y)
    return Motion(*(np.interp(s.t, t, z) for z in (m.x, m.v, m.a, m.crept)))


def _with_motions(e: Experiment, motion: Callable[[Segment], Motion]) -> Experiment:
    """The experiment with its motion imposed as it is told for each segment."""
    return imposed(e.with_segments(tuple(replace(s, motion=motion(s)) for s in e.segments)))
