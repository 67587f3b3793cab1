"""Cases for `benchmarks.trace`: recordings of a plant with an effect of a calibrated strength, and their files."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmarks.plants import STEP, integrate
from benchmarks.plants_effects import CLAMPS, FIRST, HELD, KNOWN, STALL, Valve, fields_of
from recordings import Array, Plant, Recording, Signal, write
from simulator import BASE, kernel

SECONDS = {"staircase": 40.0, "sine": 50.0, "multisine": 40.0}
"""The experiments, the last of them held out."""
FITTED = ("staircase", "sine")
COURSE = 500.0
"""Rate at which the force is laid down [Hz]; it moves straight in between."""
MULTIPLES = (3.0, 6.0, 12.0)
"""Strengths of the study, in standard deviations of the position noise."""
TOLERANCE = 0.12
"""Relative error of a calibrated strength."""
TRIM = 0.03
"""Share of the samples, those with the largest errors, that do not count in what is left: one slip that comes 20 ms
early leaves 4 noises in the mean square of 90 s, and would let a hardly visible effect pass for a strong one."""
TABLE = Path(__file__).with_name("plants_strengths.json")
"""Strengths found earlier and what they leave, by effect, valve and form, and multiple of the noise."""

CEILING = 0.0
"""Logarithm of the largest strength that makes sense: as much as the friction itself, lags of 0.1 s, 2 % of play."""
COARSE = 1e-4
"""Step of the plant while strengths are sought [s]: its error is the same with and without the effect."""

Seen = list[tuple[float, float]]
"""Logarithms of strengths tried and of what they left."""


@dataclass(frozen=True)
class Case:
    """One set of recordings. effects : ids in the plant, none for a control; strength : root mean square of what is
    left of each effect's trace in the position when the base is fitted again, in standard deviations of the noise.

    rate [Hz]; slow : at a rate below 500, whether ``both`` channels or the ``position`` alone are sampled slowly;
    noise : factor on the position noise of the valve; form : of the laws, see `benchmarks.plants_effects`.
    """

    valve: int
    effects: tuple[str, ...] = ()
    strength: float = 0.0
    form: str = "same"
    rate: float = COURSE
    slow: str = "both"
    noise: float = 1.0
    seed: int = 0

    @property
    def name(self) -> str:
        """A short unique name, fit for a folder."""
        what = "+".join(self.effects) or "none"
        slow = "" if self.rate == COURSE else f"-{self.rate:g}Hz-{self.slow}"
        noise = "" if self.noise == 1.0 else f"-n{self.noise:g}"
        return f"{what}-v{self.valve}-s{self.strength:g}-{self.form}{slow}{noise}" + (f"-{self.seed}" * (self.seed > 0))


@dataclass(frozen=True)
class Run:
    """A plant that ran one experiment, at `COURSE`. t [s]; force [N] as it was; reading [m] without noise."""

    t: Array
    force: Array
    reading: Array
    position: Array
    velocity: Array


def force_course(valve: Valve, shape: str, seconds: float, seed: int) -> Array:
    """Force [N] of an actuator on (n_samples,) at `COURSE`: the whole stroke and some more for friction, through the
    20 ms of its chamber. A staircase of ten levels, a slow sine of four periods, or a multisine of 30 lines up to
    30 periods with random phases.
    """
    rng = np.random.default_rng([valve.seed, seed, len(shape)])
    t = np.arange(round(seconds * COURSE) + 1) / COURSE
    if shape == "staircase":
        demand = rng.uniform(-0.8, 0.8, 10)[np.minimum((t * 10 / seconds).astype(int), 9)]
    elif shape == "sine":
        demand = -0.8 * np.cos(2 * np.pi * 4 * t / seconds)
    else:
        lines = np.arange(1, 31)
        demand = np.cos(2 * np.pi * np.outer(t / seconds, lines) + rng.uniform(0, 2 * np.pi, 30)).sum(axis=1)
        demand *= 0.8 / np.abs(demand).max()
    wanted = valve.load + demand * (0.5 * valve.span + 1.25 * valve.friction)
    keep = np.exp(-1 / (0.02 * COURSE))
    course: Array = lfilter([1 - keep], [1, -keep], wanted - wanted[0]) + wanted[0]
    return course


def runs(
    case: Case, strengths: dict[str, float], shapes: Iterable[str] | None = None, step: float = STEP
) -> dict[str, Run]:
    """The plant of a case, with given strengths of its effects, on some experiments, in steps of at most `step` [s]."""
    valve = Valve.of(case.valve)
    physics = valve.physics(fields_of(strengths, valve, case.form))
    found = {}
    for shape in shapes or SECONDS:
        force = force_course(valve, shape, SECONDS[shape], case.seed)
        rng = np.random.default_rng([case.valve, case.seed, len(shape), 3])
        closed = _spells(len(force), CLAMPS, CLAMPS / 5, rng) if "closing_clamp" in strengths else None
        out = integrate(physics, force, COURSE, closed=closed, step=step)
        reading = out[:, 0]
        if "repeated_samples" in strengths:
            stalled = _spells(len(force), STALL, 2.0 * strengths["repeated_samples"], rng)
            reading = reading[np.maximum.accumulate(np.where(stalled, 0, np.arange(len(force))))]
        found[shape] = Run(np.arange(len(force)) / COURSE, force, reading, out[:, 1], out[:, 2])
    return found


def _spells(n: int, every: float, length: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Random spells (n,): beginnings `every` so many seconds and lengths [s], both exponentially distributed."""
    spells, t = np.zeros(n, np.bool_), 0.0
    while t < n / COURSE:
        t += rng.exponential(every)
        lasts = rng.exponential(length)
        spells[round(t * COURSE) : round((t + lasts) * COURSE)] = True
        t += lasts
    return spells


def recordings(case: Case) -> tuple[list[Recording], list[Recording], dict[str, float]]:
    """The recordings to fit, those to hold out, and the strengths that the effects had."""
    strengths = strengths_of(case)
    made = [_measured(case, shape, run) for shape, run in runs(case, strengths).items()]
    return made[:-1], made[-1:], strengths


def save(case: Case, folder: Path) -> dict[str, float]:
    """Write a case as one file per experiment; what it is stands in /truth alone. Returns the strengths."""
    strengths = strengths_of(case)
    folder.mkdir(parents=True, exist_ok=True)
    valve = Valve.of(case.valve)
    for shape, run in runs(case, strengths).items():
        about: dict[str, float | str | Array] = {
            **valve.values, "effects": " ".join((*BASE, *case.effects)), "form": case.form,
            **{f"strength of {effect}": s for effect, s in strengths.items()},
            **{f"plant.{name}": value for name, value in fields_of(strengths, valve, case.form).items()},
            "position": run.position, "force": run.force,
        }  # fmt: skip
        write(folder / f"{shape}.h5", _measured(case, shape, run), about)
    return strengths


def _measured(case: Case, shape: str, run: Run) -> Recording:
    """What sensors and sampling leave of a run."""
    valve = Valve.of(case.valve)
    rng = np.random.default_rng([case.valve, case.seed, len(shape), 5])
    position = run.reading + rng.normal(0, case.noise * valve.position_noise, len(run.t))
    if "repeated_samples" in case.effects:  # a repeated sample repeats its noise
        fresh = np.r_[True, np.diff(run.reading) != 0]
        position = position[np.maximum.accumulate(np.where(fresh, np.arange(len(fresh)), 0))]
    force = run.force + rng.normal(0, valve.force_noise, len(run.t))
    every = round(COURSE / case.rate)
    if case.slow == "position":
        position = np.where(np.arange(len(position)) % every == 0, position, np.nan)
        every = 1
    signals = [
        Signal("time", run.t[::every], "s", "time"),
        Signal("force", force[::every], "N", "input", "net force of the actuator on the stem"),
        Signal("position", position[::every], "m", "output", "stem position"),
    ]
    return Recording.of(signals, plant=_plant(case, valve), source="simulated", title=shape)


def _plant(case: Case, valve: Valve) -> Plant:
    """What is known of the plant: its stroke, and what the effect needs to be told from the base."""
    needed = {item for effect in case.effects for item in KNOWN.get(effect, ())}
    return Plant(stroke_m=valve.stroke, **{item: valve.values[HELD[item]] for item in needed})


def strengths_of(case: Case) -> dict[str, float]:
    """The strength of each effect that, on its own, leaves what a case asks for: from the table, or found."""
    return {effect: _strength(effect, case.valve, case.form, case.strength)[0] for effect in case.effects}


def reached(case: Case) -> float:
    """What the weakest effect of a case leaves, in noises: about its strength, or less where only a senseless strength
    of the effect would do; 0 without effects."""
    return min((_strength(e, case.valve, case.form, case.strength)[1] for e in case.effects), default=0.0)


@lru_cache(maxsize=4096)
def _strength(effect: str, valve: int, form: str, multiple: float) -> tuple[float, float]:
    key = f"{effect} {valve} {form}"
    known = _table().get(key, {})
    if f"{multiple:g}" not in known:
        found = calibrated(effect, valve, form, {*MULTIPLES, multiple})
        known = {f"{m:g}": (float(f"{s:.4g}"), float(f"{left:.3g}")) for m, (s, left) in found.items()}
        _keep(key, known)
    strength, left = known[f"{multiple:g}"]
    return strength, left


def _table() -> dict[str, dict[str, tuple[float, float]]]:
    return json.loads(TABLE.read_text()) if TABLE.exists() else {}


def _keep(key: str, known: dict[str, tuple[float, float]]) -> None:
    """Add to the table, whole or not at all."""
    table = _table()
    table[key] = table.get(key, {}) | known
    part = TABLE.with_name(f"{TABLE.name}.{os.getpid()}")
    part.write_text("{\n" + ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in sorted(table.items())) + "\n}\n")
    part.replace(TABLE)


def calibrated(effect: str, valve: int, form: str, multiples: Iterable[float]) -> dict[float, tuple[float, float]]:
    """The strengths at which an effect leaves so many standard deviations of noise, and what they leave.

    A search by secants in logarithms, each trial a refit of the base model to a plant without noise; all multiples use
    all trials. Where the base takes an effect over in jumps, the nearest trial counts, and where
    it takes over so much that only a senseless strength would do, a strength of 1 that leaves less.
    """
    left = Remaining(Case(valve, (effect,), form=form))
    strength, seen, found = np.log(FIRST.get(effect, 0.05)), [], {}
    for multiple in sorted(multiples, reverse=True):
        for _ in range(7):
            if not seen or (abs(_nearest(seen, multiple)[1]) > TOLERANCE and not _too_weak(seen, multiple)):
                strength = _next(seen, multiple) if seen else strength
                seen.append((strength, np.log(max(left(float(np.exp(strength))), 1e-3))))
        best, missed = _nearest(seen, multiple)
        found[multiple] = float(np.exp(best)), float(multiple * np.exp(missed))
    return found


def _nearest(seen: Seen, multiple: float) -> tuple[float, float]:
    """The trial nearest to a multiple, of those near enough the weakest, with the logarithm of what it missed it by."""
    trials = [(strength, left - np.log(multiple)) for strength, left in seen]
    return min(trials, key=lambda one: (max(abs(one[1]), TOLERANCE), one[0]))


def _too_weak(seen: Seen, multiple: float) -> bool:
    """Whether even the strongest that makes sense leaves less than what was asked for, and so did all others."""
    strongest = max(seen)
    return strongest[0] >= CEILING and all(left < np.log(multiple) for _, left in seen)


def _next(seen: Seen, multiple: float) -> float:
    """The next logarithm of a strength: towards the lowest crossing where trials lie on either side of one, otherwise
    in proportion, at most a factor 8 away."""
    wanted = np.log(multiple)
    high = min((one for one in seen if one[1] > wanted), default=None)
    low = max((one for one in seen if one[1] < wanted and (high is None or one < high)), default=None)
    if low and high:
        share = (wanted - low[1]) / (high[1] - low[1])
        return low[0] + min(max(share, 0.1), 0.9) * (high[0] - low[0])
    strength, missed = high or low or seen[-1]
    return min(strength - float(np.clip(missed - wanted, -np.log(8), np.log(8))), CEILING)


class Remaining:
    """How much of an effect is left in the position, in noises, when the base is refitted: a function of strength.

    The refit is output error on the exact force, started at the truth and at the refit to the next weaker trial. The
    kernel's own error cancels, because it is asked for the difference that the effect makes to the plant.
    """

    def __init__(self, case: Case) -> None:
        self.case, self.valve = case, Valve.of(case.valve)
        self.plain = runs(Case(case.valve), {}, FITTED, COARSE)
        self.kernel = kernel(BASE)
        held = {HELD[item] for effect in case.effects for item in KNOWN.get(effect, ())}
        self.free = np.array([name not in held for name in self.kernel.parameters])
        self.truth = self.kernel.vector(self.valve.values)
        self.thetas: dict[float, Array] = {}
        self.before = {shape: self._run(self.truth, shape, False)[0] for shape in FITTED}

    def __call__(self, strength: float) -> float:
        effect = self.case.effects[0]
        made = runs(self.case, {effect: strength}, FITTED, COARSE)
        target = {s: self.before[s] + made[s].reading - self.plain[s].reading for s in FITTED}
        system, n = self._system(target), int(self.free.sum())
        below = max((s for s in self.thetas if s < strength), default=None)
        starts = [np.zeros(n)] if below is None else [np.zeros(n), self.thetas[below]]
        left, self.thetas[strength] = min((_refitted(system, start) for start in starts), key=lambda one: one[0])
        return left / self.valve.position_noise

    def _system(self, target: dict[str, Array]) -> Callable[[Array], tuple[Array, Array]]:
        def system(theta: Array) -> tuple[Array, Array]:
            p = self.truth.copy()
            p[self.free] *= np.exp(theta)
            found = [self._run(p, shape, True) for shape in FITTED]
            errors = np.concatenate([y - target[shape] for (y, _), shape in zip(found, FITTED, strict=True)])
            by = np.vstack([jacobian for _, jacobian in found])
            return errors, by[:, self.free] * p[self.free]

        return system

    def _run(self, p: Array, shape: str, jacobian: bool) -> tuple[Array, Array]:
        run = self.plain[shape]
        start = self.kernel.start(run.position[0], 0.0, run.force[0])
        scan = self.kernel.run(run.t, run.force, p, start, h_max=1e-3, sensitivities=jacobian)
        return scan.outputs[:, 0], np.empty(0) if scan.jacobian is None else scan.jacobian[:, 0, : len(p)]


def _refitted(system: Callable[[Array], tuple[Array, Array]], start: Array) -> tuple[float, Array]:
    """Trimmed root mean square left by at most 20 damped Gauss-Newton moves, and the parameters' logarithms."""
    theta, damping, n = start, 1e-3, len(start)
    errors, by = system(theta)
    for _ in range(20):
        matrix, gradient = by.T @ by, by.T @ errors
        if not np.isfinite(matrix).all():
            break  # a slip on the edge of happening has no derivative that is a number
        matrix[np.diag_indices(n)] *= 1 + damping
        moved = theta - np.clip(np.linalg.lstsq(matrix, gradient, rcond=1e-12)[0], -0.5, 0.5)
        trial, trial_by = system(moved)
        if not np.isfinite(trial).all() or trial @ trial >= errors @ errors:
            damping = max(10 * damping, 1e-2)
            if damping > 1e3:
                break
            continue
        settled = trial @ trial > 0.998 * (errors @ errors)
        theta, errors, by, damping = moved, trial, trial_by, damping / 5
        if settled:
            break
    return float(np.sqrt(np.mean(np.sort(errors**2)[: round((1 - TRIM) * len(errors))]))), theta
