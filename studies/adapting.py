"""What adaptation buys the observer: the same hours with its laws and without. Run: python -m studies.adapting

A valve whose friction varies along the stroke (a tight spot) and drifts with the temperature of a shift of eight hours.
It is learned in the first half hour; in the middle dry friction and viscosity are other ones. At four times a fault
comes, and two faults grow all the time. Development seeds: 1 to 9; the page is of seeds 101 and 102.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from detector import MONTH_S, Calibration, Evidence, Measurements, calibrate, healthy_residual, learn_evidence
from recordings import Array
from simulator import kernel
from studies import drawing

DT_S, PIECE_S, LEARN_S, HOUR_S = 0.1, 60.0, 1800.0, 3600.0
SHIFT_S = 8.0 * HOUR_S
SEEDS = (101, 102)
HEAD = ("drift", "what", "laws on", "laws off")

EFFECTS = ("inertia", "spring", "lugre", "position_dependent_friction")
VALUES = {
    "mass.m": 2.0, "spring.K": 1.0e5, "spring.F0": 1000.0, "lugre.fc": 120.0, "lugre.fs": 160.0, "lugre.vs": 1e-3,
    "lugre.sigma0": 3e6, "lugre.sigma1": 3.5e3, "lugre.sigma2": 8000.0, "position_dependent_friction.a": 0.5,
    "position_dependent_friction.x0": 0.02, "position_dependent_friction.w": 0.004,
    "position_dependent_friction.b": 5.0,
}  # fmt: skip
POSITION_NOISE, FORCE_NOISE = 2e-5, 5.0

ParameterFactors = Callable[[float], dict[str, float]]
"""Factors on parameters at a time of the shift [s]."""


def warm(dry: float, viscous: float) -> ParameterFactors:
    """Friction that falls by these shares by the middle of the shift, with the temperature."""

    def factors(t: float) -> dict[str, float]:
        theta = 0.5 - 0.5 * math.cos(2.0 * math.pi * t / SHIFT_S)
        friction = 1.0 - dry * theta
        return {"lugre.fc": friction, "lugre.fs": friction, "lugre.sigma2": 1.0 - viscous * theta}

    return factors


DRIFTS = {"none": warm(0.0, 0.0), "friction -20 %, viscosity -40 %": warm(0.2, 0.4)}
FAULTS: dict[str, dict[str, float]] = {
    "friction x 2": {"lugre.fc": 2.0, "lugre.fs": 2.0}, "friction x 8": {"lugre.fc": 8.0, "lugre.fs": 8.0},
    "spring -20 %": {"spring.K": 0.8},
}  # fmt: skip
GROWING = ("friction x 8", "spring -20 %")
ONSETS_H = (1.0, 3.0, 5.0, 7.0)


def force(t: Array) -> Array:
    """What drives the stem [N]: two sines, so that it never moves twice in the same way."""
    return 3000.0 + 900.0 * np.sin(2 * np.pi * t / 14.0) + 500.0 * np.sin(2 * np.pi * t / 47.0)


def simulated(seconds: float, seed: int, *changes: ParameterFactors, start_s: float = 0.0) -> Measurements:
    """The valve from a time of the shift on, its parameters constant for a minute each."""
    one, random = kernel(EFFECTS), np.random.default_rng(seed)
    n = round(PIECE_S / DT_S)
    state, times, positions = one.start(0.02, 0.0, float(force(np.array([start_s]))[0])), list[Array](), list[Array]()
    for k in range(round(seconds / PIECE_S)):
        t = start_s + PIECE_S * k + DT_S * np.arange(n + 1)
        values = dict(VALUES)
        for change in changes:
            for name, factor in change(float(t[0])).items():
                values[name] *= factor
        run = one.run(t, force(t), one.vector(values), state, h_max=5e-3)
        state = run.final
        times.append(t[:-1])
        positions.append(run.outputs[:-1, 0])
    t = np.concatenate(times)
    x = np.concatenate(positions) + POSITION_NOISE * random.standard_normal(len(t))
    return Measurements(t, {"position": x, "force": force(t) + FORCE_NOISE * random.standard_normal(len(t))})


def growing(fault: dict[str, float], by_s: float) -> ParameterFactors:
    """A fault that grows from nothing to its full size by a time of the shift."""
    return lambda t: {name: 1.0 + (factor - 1.0) * min(t / by_s, 1.0) for name, factor in fault.items()}


@dataclass(frozen=True)
class AdaptedRun:
    """The observer over a run: residual in learned thresholds, and evidence of an alarm (at 1), both (n_samples,)."""

    time_s: Array
    residual: Array
    load: Array

    @property
    def alarm_s(self) -> float | None:
        """When the evidence reached its limit."""
        over = np.flatnonzero(self.load >= 1.0)
        return float(self.time_s[over[0]]) if len(over) else None


@dataclass(frozen=True)
class LearnedObserver:
    """The observer of a valve and the evidence on it alone: one test of several, judged as in a watch."""

    calibration: Calibration
    healthy: Measurements

    @cached_property
    def evidence(self) -> Evidence:
        """What its residual is like without a fault."""
        c = self.calibration
        return learn_evidence({"observer": healthy_residual(self.healthy, c)}, c.dt_s, MONTH_S)

    def run(self, data: Measurements, adapted_by: Measurements | None = None) -> AdaptedRun:
        """Over data. adapted_by : what was seen before, from which the laws have learned."""
        c, evidence = self.calibration, self.evidence
        state = c.compiled.initial()
        if adapted_by is not None:
            state = c.compiled.initial().with_estimates(c.compiled.run(state, *c.scaled(adapted_by))[0])
        said = c.compiled.run(state, *c.scaled(data))[1]
        residual = c.unbalanced(said.xi2, said.phi)
        residual[: round(c.settle_s / c.dt_s) + 1] = np.nan
        load = evidence.run(evidence.initial(), residual[:, None])[1][:, 0]
        return AdaptedRun(data.time_s, said.xi2 * c.observer.k2 / c.least_phi, load)


def observers(seed: int) -> tuple[LearnedObserver, LearnedObserver]:
    """Learned in the first half hour: with the laws, and without."""
    data = simulated(LEARN_S, seed)
    found = calibrate(data)
    return LearnedObserver(found, data), LearnedObserver(replace(found, adapts=False), data)


def rows(drift: str, seeds: tuple[int, ...] = SEEDS) -> list[list[str]]:
    """A shift with one drift: residual level by the hour, false alarms, delays, and what grows slowly."""
    pairs = {seed: observers(seed) for seed in seeds}
    shifts = {seed: simulated(SHIFT_S, seed + 1000, DRIFTS[drift]) for seed in seeds}
    seen = {seed: [one.run(shifts[seed]) for one in pairs[seed]] for seed in seeds}
    found = []
    for hour in (1.0, 3.0, 4.0, 6.0):
        part = slice(round(hour * HOUR_S / DT_S), round((hour + 1.0) * HOUR_S / DT_S))
        cells = [float(np.mean([np.nanstd(seen[seed][k].residual[part]) for seed in seeds])) for k in (0, 1)]
        found.append([drift, f"residual, hour {hour:g}", *(f"{cell:.3f}" for cell in cells)])
    alarms = [sum(seen[seed][k].alarm_s is not None for seed in seeds) for k in (0, 1)]
    found.append([drift, "shifts with a false alarm", *(f"{count} of {len(seeds)}" for count in alarms)])
    for name, fault in FAULTS.items():
        found.append([drift, f"delay, {name} [s]", *delays(drift, fault, pairs, shifts)])
    for name in GROWING:
        found.append([drift, f"{name}, growing for 8 h: share of it at the alarm", *slow(drift, FAULTS[name], pairs)])
    return found


def delays(
    drift: str, fault: dict[str, float], pairs: dict[int, tuple[LearnedObserver, LearnedObserver]],
    shifts: dict[int, Measurements],
) -> list[str]:  # fmt: skip
    """Median delay of an abrupt fault over times and seeds, and how many were missed within ten minutes."""
    each: tuple[list[float], list[float]] = ([], [])
    for seed, pair in pairs.items():
        for hour in ONSETS_H:
            onset = hour * HOUR_S
            after = simulated(600.0, seed + 2000, DRIFTS[drift], lambda t: fault, start_s=onset)
            before = shifts[seed][: round(onset / DT_S)]
            for one, found in zip(pair, each, strict=True):
                alarm = one.run(after, before).alarm_s
                found.append(math.inf if alarm is None else alarm - onset)
    return [
        f"{np.median(found):.3g}" + (f" ({missed} of {len(found)} not in 10 min)" if missed else "")
        for found in each
        if (missed := sum(map(math.isinf, found))) >= 0
    ]


def slow(
    drift: str, fault: dict[str, float], pairs: dict[int, tuple[LearnedObserver, LearnedObserver]]
) -> list[str]:  # fmt: skip
    """How much of a fault that grows for the whole shift was there when it was found."""
    cells = list[str]()
    runs = {seed: simulated(SHIFT_S, seed + 3000, DRIFTS[drift], growing(fault, SHIFT_S)) for seed in pairs}
    for k in (0, 1):
        alarms = [pair[k].run(runs[seed]).alarm_s for seed, pair in pairs.items()]
        each = ["not found" if alarm is None else f"{alarm / SHIFT_S:.2f}" for alarm in alarms]
        cells.append(", ".join(each))
    return cells


NOTE = (
    "A valve whose friction has a tight spot and falls with the temperature of a shift of eight hours, moved by two "
    "sines, 10 Hz, noise on both sensors. Its observer is learned on the first half hour, and then watches the shift "
    "with its laws (4.20) on, and the same data with them off. Only the evidence of the observer is looked at: a watch "
    "has the innovations of the model beside it. Residual: standard deviation of the velocity error over an hour, in "
    "learned thresholds at rest. Delay: median over two seeds and four times (after 1, 3, 5 and 7 h), the laws having "
    "adapted until then; *inf*: more than ten minutes.\n\n"
    "**Here adaptation buys next to nothing.** What is left of the balance is the dry friction, which is no part of "
    "the observer's linear model and changes its sign with the motion; no law of (4.20) can take it away, and the "
    "residual is the same within one percent, drift or not. Abrupt faults are found about as soon. A weak spring that "
    "grows for hours is found later with the laws on, for they follow it as far as their sets allow, and no further: "
    "that is the price. The laws run all the same, as one test of several. That friction has doubled the observer does "
    "not see here, with laws or without: that is for the innovations of the model, which know friction.\n\n"
    "Made by `python -m studies.adapting` with seeds 101 and 102; 1 to 9 were used to develop it."
)


def main() -> None:
    """Write docs/studies/adapting.md."""
    lines = [row for drift in DRIFTS for row in rows(drift)]
    for line in lines:
        print(*line, sep=" | ", flush=True)
    drawing.page("adapting", "What adaptation buys", HEAD, lines, NOTE)


if __name__ == "__main__":
    main()
