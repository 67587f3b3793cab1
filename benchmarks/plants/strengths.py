"""How strong an effect has to be to leave a given trace: found by trials, and kept in a table."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from functools import lru_cache
from operator import itemgetter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.plants.cases import FITTED, Case, runs
from benchmarks.plants.effects import FIRST, HELD, KNOWN, Valve
from recordings import Array
from simulator import BASE, kernel

MULTIPLES = (3.0, 6.0, 12.0)
"""Strengths of the study, in standard deviations of the position noise."""
TOLERANCE = 0.12
"""Relative error of a calibrated strength."""
TRIM = 0.03
"""Share of the samples, those with the largest errors, that do not count in what is left: one slip that comes 20 ms
early leaves 4 noises in the mean square of 90 s, and would let a hardly visible effect pass for a strong one."""
TABLE = Path(__file__).with_name("strengths.json")
"""Strengths found earlier and what they leave, by effect, valve and form, and multiple of the noise."""

CEILING = 0.0
"""Logarithm of the largest strength that makes sense: as much as the friction itself, lags of 0.1 s, 2 % of play."""
STEEPEST = 1e6
"""Largest derivative of a position by a logarithm of a parameter that means something [m]: a slip on the edge of
happening has none."""
COARSE = 1e-4
"""Step of the plant while strengths are sought [s]: its error is the same with and without the effect."""

System = Callable[[Array], tuple[Array, Array]]
"""Errors (n_samples,) of parameters' logarithms, and their derivatives (n_samples, n_parameters)."""
Seen = list[tuple[float, float]]
"""Logarithms of strengths tried and of what they left."""


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

    The refit is output error on the exact force, started at the truth and at the refit to the next weaker trial. First
    of all squares, then of those that count (least trimmed squares: Rousseeuw 1984): slips that come early or late hold
    most of the squares, and a descent of all of them ends at the first slip that it would have to move. The kernel's
    own error cancels, because it is asked for the difference that the effect makes to the plant.
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
        ends = [_refitted(system, start) for start in starts]
        starts = [np.zeros(n), min(ends, key=itemgetter(0))[1]]
        ends += [_refitted(system, start, 1 - TRIM) for start in starts]
        left, self.thetas[strength] = min(ends, key=itemgetter(0))
        return left / self.valve.position_noise

    def _system(self, target: dict[str, Array]) -> System:
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


def _refitted(system: System, start: Array, share: float = 1.0) -> tuple[float, Array]:
    """Trimmed root mean square left by at most 20 damped Gauss-Newton moves, and the parameters' logarithms.

    share : of the samples, those with the least errors, whose squares the moves make less.
    """
    theta, damping, n = start, 1e-3, len(start)
    errors, by = system(theta)
    left = _rms(errors, share)
    for _ in range(20):
        known = _least(errors, share) & (np.abs(by).max(axis=1) < STEEPEST)
        matrix, gradient = by[known].T @ by[known], by[known].T @ errors[known]
        matrix[np.diag_indices(n)] *= 1 + damping
        moved = theta - np.clip(np.linalg.lstsq(matrix, gradient, rcond=1e-12)[0], -0.5, 0.5)
        trial, trial_by = system(moved)
        less = _rms(trial, share) if np.isfinite(trial).all() else np.inf
        if less >= left:
            damping = max(10 * damping, 1e-2)
            if damping > 1e3:
                break
            continue
        settled = less > 0.999 * left
        theta, errors, by, left, damping = moved, trial, trial_by, less, damping / 5
        if settled:
            break
    return _rms(errors, 1 - TRIM), theta


def _least(errors: Array, share: float) -> NDArray[np.bool_]:
    """Which samples are that share of them with the least errors."""
    return np.asarray(np.abs(errors) <= np.quantile(np.abs(errors), share))


def _rms(errors: Array, share: float) -> float:
    """Root mean square of that share of the samples with the least errors."""
    return float(np.sqrt(np.mean(errors[_least(errors, share)] ** 2)))
