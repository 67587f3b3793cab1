"""A recording made ready for fitting: SI arrays, causality, contiguous segments, smoothed motion, noise levels."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from identification.data.noise import noise_std
from identification.data.smoothing import Motion, smooth
from recordings import Array, BadInput, Recording
from simulator import Causality

SHORTEST = 20
"""A segment with fewer samples than this teaches nothing and is left out."""

GAP = 5.0
"""Spacing, in medians of the spacing, above which the recording is cut into segments."""


@dataclass(frozen=True)
class Segment:
    """A stretch of a recording without gaps, arrays (n_samples,) in SI units.

    t : time from the beginning of the segment [s]; u : force on the stem [N]; y : position [m]; seen : where the
    measured output is known (the other samples are bridged by interpolation and count nothing); motion : the smoothed
    position and its derivatives; load : what effects that grow with the load depend on where the motion is imposed [N].
    """

    t: Array
    u: Array
    y: Array
    seen: NDArray[np.bool_]
    motion: Motion
    load: Array

    def part(self, first: int, last: int, every: int = 1) -> Segment:
        """The samples [first, last), or one of so many of them."""
        s = slice(first, last, every)
        m = self.motion
        motion = Motion(m.x[s], m.v[s], m.a[s], m.crept[s])
        return Segment(self.t[s], self.u[s], self.y[s], self.seen[s], motion, self.load[s])

    @property
    def dt(self) -> float:
        """Median spacing of the samples [s]."""
        return float(np.median(np.diff(self.t)))


@dataclass(frozen=True)
class Experiment:
    """What a recording says, in the form in which a fit uses it. Made by `experiment`.

    name : for messages; causality : ``force`` (force in, position out) or ``motion`` (motion in, force out);
    segments : the stretches without gaps; noise_position [m], noise_force [N] : standard deviations of the white noise,
    estimated from the recording; plant : what the recording says of the valve, by item of /plant; hold : the force is
    held between samples instead of changing linearly.
    """

    name: str
    causality: Causality
    segments: tuple[Segment, ...]
    noise_position: float
    noise_force: float
    plant: dict[str, float | str] = field(default_factory=dict)
    hold: bool = False

    @property
    def samples(self) -> int:
        """Number of samples in all segments."""
        return sum(len(s.t) for s in self.segments)

    @property
    def output_noise(self) -> float:
        """Standard deviation of the measured output's noise [m], or [N] where the motion is imposed."""
        return self.noise_position if self.causality == "force" else self.noise_force

    def with_segments(self, segments: tuple[Segment, ...]) -> Experiment:
        """The same experiment restricted to other segments."""
        return replace(self, segments=segments)


def experiment(recording: Recording, causality: Causality | None = None, *, hold: bool = False) -> Experiment:
    """Make a recording ready for fitting: SI units, segments without gaps, smoothed motion, noise levels.

    Parameters
    ----------
    recording : Recording
        With a position, and a force or a pressure and the diaphragm area of its plant.
    causality : {"force", "motion"}, optional
        What drives the valve. By default the roles of the signals say it: where the position is an input, a rig imposes
        the motion.
    hold : bool
        The force is held from sample to sample (a converter's output) instead of changing linearly between them.

    Raises
    ------
    BadInput
        When there is no position, neither force nor pressure with an area, or no stretch without gaps long enough.
    """
    name = recording.path.name if recording.path else recording.title or "recording"
    position, position_step = _position(recording, name)
    force, force_step = _force(recording, name)
    causality = causality or ("motion" if recording["position"].role == "input" else "force")
    t = np.asarray(recording.time)
    noise_x, noise_u = noise_std(position, position_step, t), noise_std(force, force_step, t)
    driven, measured = (force, position) if causality == "force" else (position, force)
    load = force if causality == "force" else _load(recording, len(t))
    segments = tuple(
        _segment(t[s], force[s], position[s], np.isfinite(measured[s]), noise_x, load[s])
        for s in _stretches(t, driven, measured)
    )
    if not segments:
        raise BadInput(name, f"no stretch of {SHORTEST} samples without a gap", "record longer or repair the gaps")
    plant = recording.plant.known()
    return Experiment(name, causality, segments, noise_x, noise_u, plant, hold)


def _position(recording: Recording, name: str) -> tuple[Array, float]:
    if "position" not in recording:
        raise BadInput(f"{name}: /signals", "there is no signal named position", "a fit needs position and force")
    signal = recording.si("position")
    return np.asarray(signal.values, float), signal.resolution or 0.0


def _force(recording: Recording, name: str) -> tuple[Array, float]:
    """The force of the actuator on the stem: recorded, or chamber pressure times diaphragm area."""
    if "force" in recording:
        signal = recording.si("force")
        return np.asarray(signal.values, float), signal.resolution or 0.0
    area = recording.plant.diaphragm_area_m2
    if "pressure" in recording and area:
        signal = recording.si("pressure")
        return area * np.asarray(signal.values, float), area * (signal.resolution or 0.0)
    found = "there is a pressure but no /plant diaphragm_area_m2" if "pressure" in recording else "there is no force"
    remedy = "a fit needs force, or pressure with the diaphragm area"
    raise BadInput(f"{name}: /signals", found, remedy, parameter="area")


def _load(recording: Recording, samples: int) -> Array:
    """What loads the seals while a rig imposes the motion [N]: the force of the air, or a normal force.

    The force of the air counts against the rod, as it does in a recorded force that is free of it.
    """
    area = recording.plant.diaphragm_area_m2
    if "force" in recording and "pressure" in recording and area:
        return -area * np.asarray(recording.si("pressure").values, float)
    if "normal_force" in recording:
        return np.asarray(recording.si("normal_force").values, float)
    return np.zeros(samples)


def imposed(e: Experiment) -> Experiment:
    """The same experiment with its motion imposed and its force predicted.

    A held force acts from its sample to the next one, so it goes with the motion half a sample later.
    """
    if e.causality == "motion":
        return e
    segments = tuple(_half_later(s) for s in e.segments) if e.hold else e.segments
    return replace(e, causality="motion", segments=segments)


def noisy(
    e: Experiment, s: Segment, x: Array, rng: np.random.Generator, *, size: float = 1.0, force: bool = True
) -> Segment:
    """A segment s with positions x (n_samples,) [m] instead of its own, and new noise in them, `size` times that of the
    experiment, and in its force unless that is exact. Smoothed anew.
    """
    y = x + rng.normal(0.0, size * e.noise_position, len(x))
    u = s.u + rng.normal(0.0, e.noise_force, len(x)) if force else s.u
    return replace(s, y=y, u=u, motion=smooth(s.t, y, e.noise_position))


def _half_later(s: Segment) -> Segment:
    middle = s.t + 0.5 * np.append(np.diff(s.t), s.t[-1] - s.t[-2])
    m = s.motion
    x, v, a, crept = (np.interp(middle, s.t, z) for z in (m.x, m.v, m.a, m.crept))
    return replace(s, motion=Motion(x, v, a, crept))


def _stretches(t: Array, driven: Array, measured: Array) -> list[slice]:
    """Slices without gaps in time, with the driving signal known throughout and the measured one somewhere."""
    ok = np.isfinite(driven)
    gap = np.append(np.diff(t) > GAP * np.median(np.diff(t)), True)
    edges = np.flatnonzero(gap | ~ok | np.append(~ok[1:], True)) + 1
    first, found = 0, []
    for last in edges.tolist():
        good = ok[first:last]
        if good.all() and last - first >= SHORTEST and np.isfinite(measured[first:last]).sum() >= SHORTEST:
            found.append(slice(first, last))
        first = last
    return found


def _segment(t: Array, u: Array, y: Array, seen: NDArray[np.bool_], noise: float, load: Array) -> Segment:
    u, y, load = (_bridged(t, z) for z in (u, y, load))
    t = t - t[0]
    return Segment(t, u, y, seen, smooth(t, y, noise), load)


def _bridged(t: Array, z: Array) -> Array:
    known = np.isfinite(z)
    return np.interp(t, t[known], z[known]) if known.any() else np.zeros(len(t))
