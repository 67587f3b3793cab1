"""Excitations: what to ask of a valve so that its recordings teach something. Seeded, deterministic, in fractions.

An excitation is a demand r(t): 0 asks for the low end of the stroke, 1 for the high end. `force_demand` turns it into
the force of an actuator that would hold the valve there without friction, widened so that friction is overcome.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from recordings import Array, BadInput

Shape = Callable[[Array, float, np.random.Generator], Array]
"""From times (n,) [s], a duration [s] and a source of random numbers to the demand (n,), a share of the stroke."""

LOW, HIGH = 0.1, 0.9
"""The part of the stroke that excitations use."""


def step(t: Array, duration: float, rng: np.random.Generator) -> Array:
    """Rest, one step up, one step down: sizes drawn from the middle of the range.

    t (n,) [s] : times from 0 to duration [s]; gives the demand (n,), a share of the stroke; rng draws the sizes.
    """
    low, high = rng.uniform(LOW, 0.35), rng.uniform(0.65, HIGH)
    return np.where((t > 0.2 * duration) & (t < 0.6 * duration), high, low)


def staircase(t: Array, duration: float, rng: np.random.Generator) -> Array:
    """Ten seeded levels, each held for a tenth of the time.

    t (n,) [s] : times from 0 to duration [s]; gives the demand (n,), a share of the stroke; rng draws the levels.
    """
    levels = rng.uniform(LOW, HIGH, 10)
    return levels[np.minimum((t / duration * 10).astype(int), 9)]


def ramp(t: Array, duration: float, rng: np.random.Generator) -> Array:
    """One slow stroke up and down: the valve signature test.

    t (n,) [s] : times from 0 to duration [s]; gives the demand (n,), a share of the stroke; rng is not used.
    """
    return LOW + (HIGH - LOW) * (1 - np.abs(2 * t / duration - 1))


def sine(t: Array, duration: float, rng: np.random.Generator) -> Array:
    """Slow sine over the stroke, four periods: reversals, Stribeck region and sliding.

    t (n,) [s] : times from 0 to duration [s]; gives the demand (n,), a share of the stroke; rng is not used.
    """
    return 0.5 - 0.5 * (HIGH - LOW) * np.cos(2 * np.pi * 4 * t / duration)


def multisine(t: Array, duration: float, rng: np.random.Generator) -> Array:
    """Schroeder-phased multisine, 30 lines from one period per duration upwards (Schroeder, IEEE TIT 16, 1970).

    t (n,) [s] : times from 0 to duration [s]; gives the demand (n,), a share of the stroke; rng is not used.
    """
    lines = np.arange(1, 31)
    phases = -np.pi * lines**2 / len(lines)
    signal = np.cos(2 * np.pi * np.outer(t / duration, lines) + phases).sum(axis=1)
    return 0.5 + 0.45 * (HIGH - LOW) * signal / np.abs(signal).max()


def chirp(t: Array, duration: float, rng: np.random.Generator) -> Array:
    """Sine of rising frequency, 0.1 to 3 Hz, with an amplitude that falls as the frequency rises.

    t (n,) [s] : times from 0 to duration [s]; gives the demand (n,), a share of the stroke; rng is not used.
    """
    low, high = 0.1, 3.0
    rate = np.log(high / low) / duration
    phase = 2 * np.pi * low * np.expm1(rate * t) / rate
    return 0.5 + 0.5 * (HIGH - LOW) * np.exp(-0.5 * rate * t) * np.sin(phase)


def presliding(t: Array, duration: float, rng: np.random.Generator) -> Array:
    """A still valve pushed to and fro below break-away: only the bristles move.

    t (n,) [s] : times from 0 to duration [s]; gives (n,) about 0.5, whose swing of 1 `force_demand` scales by the
    break-away force; rng is not used.
    """
    return 0.5 + np.sin(2 * np.pi * t) * np.minimum(1.0, t)


SHAPES: Mapping[str, Shape] = {f.__name__: f for f in (step, staircase, ramp, sine, multisine, chirp, presliding)}
"""The open-loop excitations by name. ``positioner`` is a staircase behind a position controller."""

MIXED = ("staircase", "sine", "multisine", "presliding")
"""The sequence that pins every parameter of a LuGre valve best for its length."""


@dataclass(frozen=True)
class Excitation:
    """A sequence of named shapes, each with a duration [s].

    >>> Excitation.parse("step:5,sine:20").duration
    25.0
    """

    parts: tuple[tuple[str, float], ...]

    @classmethod
    def parse(cls, text: str) -> Excitation:
        """Read ``NAME:SECONDS[,NAME:SECONDS...]``; ``mixed:T`` stands for the sequence `MIXED`. Raises BadInput."""
        parts: list[tuple[str, float]] = []
        for item in text.split(","):
            name, _, seconds = item.strip().partition(":")
            known = (*SHAPES, "mixed", "positioner")
            if name not in known:
                raise BadInput(f"excitation {item.strip()!r}", "no such shape", f"there are {', '.join(known)}")
            duration = _seconds(item, seconds or "20")
            parts += [(shape, duration / len(MIXED)) for shape in MIXED] if name == "mixed" else [(name, duration)]
        if len(parts) > 1 and any(shape == "positioner" for shape, _ in parts):
            found = "a positioner closes the loop over the whole recording"
            raise BadInput(f"excitation {text!r}", found, "give positioner:SECONDS alone")
        return cls(tuple(parts))

    @property
    def duration(self) -> float:
        """Total duration [s]."""
        return sum(seconds for _, seconds in self.parts)

    @property
    def closed_loop(self) -> bool:
        """Whether a positioner closes the loop (then it must be the only part)."""
        return any(name == "positioner" for name, _ in self.parts)


def _seconds(item: str, text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = float("nan")
    if not 0 < seconds < 1e7:
        raise BadInput(f"excitation {item.strip()!r}", f"{text!r} is no duration", "write NAME:SECONDS, as in sine:20")
    return seconds


def force_demand(
    excitation: Excitation, t: Array, *, spring: float, preload: float, stroke: float, friction: float, seed: int
) -> Array:
    """Actuator force [N] (n_samples,) for an open-loop excitation over times t [s].

    spring [N/m], preload [N], stroke [m]: of the valve; friction [N]: its break-away force, by which the range is
    widened so that the stem really travels; a first-order lag of 20 ms stands for the actuator's chamber.
    """
    rng = np.random.default_rng(seed)
    middle, half = preload + 0.5 * spring * stroke, 0.5 * spring * stroke + 1.25 * friction
    force, start = np.empty(len(t)), t[0]
    for name, seconds in excitation.parts:
        part = (t >= start) & (t <= start + seconds + 1e-9)
        demand = SHAPES[name](t[part] - start, seconds, rng)
        scale = 0.6 * friction if name == "presliding" else 2 * half
        force[part] = middle + scale * (demand - 0.5)
        start += seconds
    return _lagged(t, force, 0.02)


def _lagged(t: Array, signal: Array, time_constant: float) -> Array:
    """First-order lag with its initial state on the signal."""
    lagged = np.empty_like(signal)
    now = signal[0]
    keep = np.exp(-np.diff(t, prepend=t[0]) / time_constant)
    for i, (wanted, k) in enumerate(zip(signal.tolist(), keep.tolist(), strict=True)):
        now = wanted + k * (now - wanted)
        lagged[i] = now
    return lagged
