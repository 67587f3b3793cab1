"""Further detectors of the source's Chapter 3: banks, sets of decoupled residuals, an envelope, physical parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.signal import lfilter

from detector.evaluation.benchmark.runs import CV, P1, P2, F, X
from detector.evaluation.contract import BenchmarkRun, Channels, Detector, LearnedDetector
from detector.evaluation.linear import Linearised, inputs, linearise, outputs
from detector.generators import (
    Generator,
    all_but_one,
    evolve_neural,
    learn_dedicated,
    learn_envelope,
    learn_estimation,
    learn_score_bank,
    learn_takagi_sugeno,
    structured,
    unknown_input,
)
from detector.generators.drive.servo import CHANGES
from recordings import Array

_LEARNED = slice(100, 7300)
"""Two hours after the run-in."""
_SETTLE = 100

PHYSICAL = ("spring", "friction", "supply", "leak")
"""Constants of the drive that are estimated together: spring rate and preload, friction, supply pressure, leak."""


def smoothed(residuals: Array, memory: float) -> Array:
    """Exponential means over a memory [s], of unit spread for white residuals of unit spread."""
    a = np.exp(-1.0 / memory)
    kept = np.clip(np.nan_to_num(residuals), -30, 30)
    return lfilter([np.sqrt(1 - a * a)], [1.0, -a], kept, axis=0)


def with_means(residuals: Array) -> Array:
    """Residuals and their means over 30 s."""
    return np.hstack([residuals, smoothed(residuals, 30.0)])


def _plain(generator: Generator) -> Channels:
    """Residuals of a generator of CV and the pressure drop, X and F, with their means."""
    return lambda data: with_means(generator.run(generator.initial(), inputs(data.signals), outputs(data.signals))[1])


def _takagi_sugeno(healthy: BenchmarkRun) -> Channels:
    run = healthy.signals[_LEARNED]
    return _plain(learn_takagi_sugeno(inputs(run), outputs(run)))


def _dedicated(healthy: BenchmarkRun) -> Channels:
    run = healthy.signals[_LEARNED]
    return _plain(learn_dedicated(inputs(run), outputs(run)))


def _evolved(healthy: BenchmarkRun) -> Channels:
    run = healthy.signals[_LEARNED]
    return _plain(evolve_neural(inputs(run), outputs(run)).observer)


def _scaled(model: Linearised, watches: list[Generator], healthy: BenchmarkRun) -> Channels:
    """Residuals of generators of the linear plant, over what they are without a fault."""

    def residuals(run: Array) -> Array:
        u, y = model.inputs(run), model.outputs(run)
        return np.hstack([one.run(one.initial(), u, y)[1] for one in watches])

    usual = np.std(residuals(healthy.signals[_LEARNED])[_SETTLE:], axis=0) + 1e-12
    return lambda data: with_means(residuals(data.signals) / usual)


def _structured(healthy: BenchmarkRun) -> Channels:
    model = linearise(healthy.signals[_LEARNED])
    return _scaled(model, [structured(model.plant, all_but_one(model.plant.sizes[2]))], healthy)


def _unknown_input(healthy: BenchmarkRun) -> Channels:
    """One observer that the set point cannot move, and one that the pressure drop cannot."""
    model = linearise(healthy.signals[_LEARNED])
    p = model.plant
    return _scaled(model, [unknown_input(p, p.B[:, [j]], p.D[:, [j]]) for j in range(p.sizes[0])], healthy)


def _envelope(healthy: BenchmarkRun) -> Channels:
    """CV to X, and X to the logarithm of the flow over the root of the pressure drop."""

    def conductance(run: Array) -> Array:
        drop = np.maximum(run[:, P1] - run[:, P2], 1e-3)
        return np.asarray(np.log(np.clip(run[:, F], 0.02, 0.95) / np.sqrt(drop)), np.float64)

    run = healthy.signals[_SETTLE:]
    envelopes = learn_envelope(run[:, CV], run[:, X]), learn_envelope(run[:, X], conductance(run))

    def channels(data: BenchmarkRun) -> Array:
        pairs = (data.signals[:, CV], data.signals[:, X]), (data.signals[:, X], conductance(data.signals))
        outside = [
            one.run(one.initial(), u[:, None], y[:, None])[1] for one, (u, y) in zip(envelopes, pairs, strict=True)
        ]
        # Inside the envelope nothing is said: a trace of something else keeps the levels from being zero.
        return with_means(np.hstack(outside) + 1e-3)

    return channels


def _physical(healthy: BenchmarkRun) -> Channels:
    """Constants of the drive by recursive least squares: what each would add to the position is its regressor."""
    servo = healthy.model.servo
    chosen = [list(CHANGES).index(name) for name in PHYSICAL]

    def rows(run: Array) -> tuple[Array, Array]:
        u = np.column_stack([run[:, CV], (run[:, P1] - run[:, P2]) * 4e6])
        model = servo.position(servo.initial(), u, float(run[0, X]))[1]
        return servo.answers(u, float(run[0, X]))[_SETTLE:, chosen], (run[:, X] - model)[_SETTLE:]

    learned = learn_estimation(*rows(healthy.signals[: _LEARNED.stop]), memory=300.0)

    def channels(data: BenchmarkRun) -> Array:
        u, y = rows(data.signals)
        found = learned.run(learned.initial(), np.nan_to_num(u), np.nan_to_num(y)[:, None])[1]
        return np.vstack([np.zeros((min(_SETTLE, len(data.signals)), len(PHYSICAL))), found])

    return channels


def _score_bank(healthy: BenchmarkRun) -> Channels:
    """What the bank knows, learned: no name plate and no constants of this valve."""
    u, y = [CV, P1, P2], [X, F]
    bank = learn_score_bank(healthy.signals[:, u], healthy.signals[:, y])
    return lambda data: bank.run(bank.initial(), data.signals[:, u], data.signals[:, y])[1]


FURTHER: Mapping[str, Detector] = {
    "takagi-sugeno": LearnedDetector("Takagi-Sugeno bank of local linear observers", _takagi_sugeno),
    "dedicated": LearnedDetector("dedicated neural scheme: an observer for each output", _dedicated),
    "evolved": LearnedDetector("neural observer whose structure a genetic search found", _evolved),
    "structured": LearnedDetector("structured parity set, each residual blind to one fault", _structured),
    "unknown-input": LearnedDetector("unknown-input observers, blind to set point or pressure drop", _unknown_input),
    "envelope": LearnedDetector("qualitative envelope of a monotone lag", _envelope),
    "physical": LearnedDetector("recursive estimation of the drive's physical constants", _physical),
    "scores": LearnedDetector("the bank's scores on relations learned from data alone", _score_bank),
}
"""By name, as `detector.evaluation.detectors.DETECTORS`, which takes them in."""
