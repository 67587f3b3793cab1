"""Where a recording shows steady sliding, found in its motion alone.

None of the rules knows a model. The speed stands clear of the noise, and it is no slip, which is over in a few windows.
Later, in `regression`: since the stem last started or turned it has gone a way beside which presliding is short, and
the speed hardly changes over such a way. How long presliding is, the recording says too (`library`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from identification.data.experiment import Experiment, Segment
from identification.sparse_regression.weak_form import samples_of_window, weak, window
from recordings import Array

CLEAR = 5.0
"""Speed of a sliding stem, at least, in standard deviations of its noise."""
STEADY, WIDER = 0.2, 3
"""Share of the speed by which it may differ from its mean over a window so many times as wide: a slip does."""
BLOCK = 1.0
"""Longest block of windows [s] whose errors may hang together."""


@dataclass(frozen=True)
class Sliding:
    """Windows of steady sliding, arrays (n_windows,).

    x [m], v [m/s], a [m/s2], force [N] : means over the window; direction : 1 rising, -1 falling; travelled [m] : since
    the stem last started or turned; change [m/s2] : size of the mean acceleration over a window `WIDER` times as wide;
    block : number of the block of windows; model (n_windows, n) : means of the columns of a model.
    """

    x: Array
    v: Array
    a: Array
    force: Array
    direction: Array
    travelled: Array
    change: Array
    block: NDArray[np.int_]
    model: Array

    def __len__(self) -> int:
        return len(self.x)

    def where(self, chosen: NDArray[np.bool_]) -> Sliding:
        """Some of the windows."""
        return Sliding(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})


def sliding(experiments: Sequence[Experiment], models: Sequence[Array] | None = None) -> Sliding:
    """The windows in which a stem slides; models : a model's columns (n_samples, n), one for each segment."""
    segments = [(s, e) for e in experiments for s in e.segments]
    given = [np.empty((len(s.t), 0)) for s, _ in segments] if models is None else models
    found, blocks = list[Array](), 0
    for (segment, experiment), columns in zip(segments, given, strict=True):
        table = _windows(segment, experiment, columns)
        table[:, 7] += blocks
        blocks = int(table[:, 7].max(initial=blocks)) + 1
        found.append(table)
    table = np.concatenate(found)
    x, v, a, force, direction, travelled, change, block = table[:, :8].T
    return Sliding(x, v, a, force, np.sign(direction), travelled, change, block.astype(int), table[:, 8:])


def _windows(segment: Segment, experiment: Experiment, columns: Array) -> Array:
    """The windows of one segment as a table, in the order of `Sliding`; blocks are numbered from 0."""
    m, dt, test = segment.motion, segment.dt, window(segment.dt)
    v, wide, change = _averaged(m.v, test), _averaged(m.v, _wider(test)), _averaged(m.a, _wider(test))
    direction = np.where(np.abs(v) > CLEAR * _speed_noise(experiment.noise_position, dt), np.sign(v), 0.0)
    turned = np.diff(direction, prepend=np.nan) != 0
    run = np.cumsum(turned) - 1
    travelled = np.abs(m.x - m.x[turned][run])
    steady = np.abs(v - wide) < STEADY * np.abs(v)
    force = np.append(segment.u[:1], 0.5 * (segment.u[1:] + segment.u[:-1])) if experiment.hold else segment.u
    piece = np.floor(segment.t / BLOCK)
    table = np.column_stack([m.x, m.v, m.a, force, direction, travelled, np.abs(change), run, piece, columns])
    table = weak(table, segment.seen & (direction != 0) & steady, dt)
    table = table[np.abs(table[:, 4]) > 1 - 1e-9]  # a window over a turn slides both ways
    pair = np.rint(table[:, 7:9])
    block = np.unique(pair, axis=0, return_inverse=True)[1].reshape(-1)
    return np.column_stack([table[:, :7], block, table[:, 9:]])


def _wider(test: Array) -> Array:
    """A window `WIDER` times as wide."""
    wide = np.hanning(WIDER * (len(test) - 1) + 1)
    return np.asarray(wide / wide.sum(), float)


def _averaged(signal: Array, test: Array) -> Array:
    """Means (n_samples,) over the window about every sample; a short signal stays as it is."""
    return np.convolve(signal, test, "same") if len(signal) >= len(test) else signal


def _speed_noise(noise: float, dt: float) -> float:
    """Standard deviation [m/s] of the mean speed in a Hann window from positions with noise [m]: the noise times the
    norm of the window's slope, which takes the derivative.
    """
    length = samples_of_window(dt) * dt
    return float(noise * np.sqrt(2 * np.pi**2 * dt / length**3))
