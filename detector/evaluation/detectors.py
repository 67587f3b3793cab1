"""The detectors that are compared: each learns from fault-free runs, then makes channels of a run.

A generator whose file says how it is evaluated (`EvaluatedGenerator`) is found by itself. Any other detector is one
function here and one line in `DETECTORS`; one of somebody's own is any object that obeys `Detector`, given to
`evaluate`.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from detector.evaluation.benchmark.runs import CV, P1, P2, SIGNALS, F, X
from detector.evaluation.contract import BenchmarkRun, Channels, Detector, LearnedDetector
from detector.evaluation.further import FURTHER, smoothed, with_means
from detector.evaluation.isolation.symptoms import MEMORIES, SCORES, Symptoms
from detector.evaluation.linear import inputs, linearise, outputs
from detector.generators import (
    FaultTree,
    Fuzzy,
    MatchedFilters,
    Rule,
    Voting,
    dfd,
    dfi,
    full_order,
    functional,
    learn_estimation,
    learn_innovation_form,
    learn_neural,
    learn_spectrum,
    settled,
    temporal,
)
from detector.generators.contract import EvaluatedGenerator, Generator
from detector.generators.fuzzy import FuzzyTerm
from detector.measurements import Measurements
from detector.observer.velocity import SteadyKalman
from detector.published import chapter_5
from detector.watch.learning import learn as calibrated
from recordings import Array, instances_of
from simulator.damadics import SPANS, Parameters

_STROKE = Parameters().stroke
_SETTLE = 100
"""What is learned from readings after a start's first [s] is tried on such readings only."""
_LENIENT = 360.0
"""False alarms a month that the calibrated observer is learned for: its level is set anew, as everyone's."""


def _alone(generator: Generator, y: Array) -> Array:
    return generator.run(generator.initial(), np.zeros((len(y), 0)), y)[1]


def _of_generator(one: EvaluatedGenerator) -> Detector:
    """A generator that says itself how it is evaluated."""

    def rows(run: Array) -> Array:
        return one.measurements(dict(zip(SIGNALS, run.T, strict=True)))

    def learn(healthy: BenchmarkRun) -> Channels:
        generator = one.learn(rows(healthy.signals[_SETTLE:]))
        return lambda data: _alone(generator, rows(data.signals))

    return LearnedDetector(one.text, learn)


def _voting(healthy: BenchmarkRun) -> Channels:
    learned = _three_positions(healthy.signals, healthy.model)[100:]
    middle = np.median(learned, axis=1, keepdims=True)
    voting = Voting(tuple((np.std(learned - middle, axis=0) + 1e-3).tolist()))
    return lambda data: _alone(voting, _three_positions(data.signals, data.model))


def _three_positions(run: Array, symptoms: Symptoms) -> Array:
    """The position three times: from its sensor, from the servo's model, and from the flow."""
    x = run[:, X]
    model = x - symptoms.residuals(run)[0] * symptoms.servo.noise
    drop = (run[:, P1] - run[:, P2]) / symptoms.drop
    grid = np.linspace(0.0, 1.0, 401)
    flow, _ = symptoms.flow.expected(np.ones(len(grid)), grid)
    relative = run[:, F] / np.sqrt(np.maximum(drop, 1e-6))
    seen = np.interp(-relative, -flow, grid)
    usable = (run[:, F] > 0.02) & (run[:, F] < 0.97)
    return np.column_stack([x, model, np.where(usable, seen, model)])


def _spectrum(healthy: BenchmarkRun) -> Channels:
    def signals(run: Array) -> Array:
        return np.column_stack([run[:, X] - run[:, CV], np.clip(run[:, F], 0, 0.95), run[:, P1], run[:, P2]])

    learned = learn_spectrum(signals(healthy.signals[100:7300]))
    return lambda data: _alone(learned, signals(data.signals))


def _full_order(healthy: BenchmarkRun) -> Channels:
    model = linearise(healthy.signals[100:7300])
    watch = full_order(model.plant, np.linspace(0.3, 0.6, model.plant.order))

    def channels(data: BenchmarkRun) -> Array:
        u, y = model.inputs(data.signals), model.outputs(data.signals)
        return with_means(10 * watch.run(watch.initial(), u, y)[1])

    return channels


def _functional(healthy: BenchmarkRun) -> Channels:
    model = linearise(healthy.signals[100:7300])
    order = model.plant.observability_index
    watches = [functional(model.plant, np.linspace(0.3, 0.5, order), which) for which in (0, 1)]

    def channels(data: BenchmarkRun) -> Array:
        u, y = model.inputs(data.signals), model.outputs(data.signals)
        return with_means(10 * np.hstack([watch.run(watch.initial(), u, y)[1] for watch in watches]))

    return channels


def _parity(healthy: BenchmarkRun) -> Channels:
    model = linearise(healthy.signals[100:7300])
    relations = temporal(model.plant, model.plant.order)
    ways = relations.directions()

    def channels(data: BenchmarkRun) -> Array:
        r = relations.run(relations.initial(), model.inputs(data.signals), model.outputs(data.signals))[1]
        return np.column_stack([np.sqrt(dfd(r)), dfi(smoothed(10 * r, 30.0), ways)])

    return channels


def _kalman(healthy: BenchmarkRun) -> Channels:
    learned = healthy.signals[100:14_500]
    model = learn_innovation_form(inputs(learned), outputs(learned))
    watch = settled(model.plant, *model.covariances)
    # Faults of the plant: sensors of X and F, then the set point.
    responses = {name: watch.response(fault, 30) for fault, name in enumerate(("X sensor", "F sensor", "set point"))}
    bank = MatchedFilters(responses)

    def channels(data: BenchmarkRun) -> Array:
        u, y = inputs(data.signals) - model.means[0], outputs(data.signals) - model.means[1]
        r = watch.run(watch.initial(), u, y)[1]
        return np.hstack([r, _alone(bank, r)])

    return channels


def _estimation(healthy: BenchmarkRun) -> Channels:
    def rows(run: Array) -> tuple[Array, Array]:
        x, cv, drop = run[:, X], run[:, CV], run[:, P1] - run[:, P2]
        late = [np.concatenate([column[:1], column[:-1]]) for column in (x, cv, drop)]
        return np.column_stack([late[0], cv, late[1], drop, late[2], np.ones(len(x))]), x

    regressors, x = rows(healthy.signals[_SETTLE:7300])
    learned = learn_estimation(regressors, x, memory=200.0)

    def channels(data: BenchmarkRun) -> Array:
        # The run-in of a valve that starts at rest is no small error: the estimates would remember it for minutes.
        u, y = rows(data.signals[_SETTLE:])
        return np.vstack([np.zeros((_SETTLE, len(learned.usual))), learned.run(learned.initial(), u, y[:, None])[1]])

    return channels


def _neural(healthy: BenchmarkRun) -> Channels:
    def signals(run: Array) -> tuple[Array, Array]:
        return run[:, [CV, P1, P2]], np.column_stack([run[:, X], np.clip(run[:, F], 0, 0.97)])

    learned = learn_neural(*signals(healthy.signals[100:10_000]))
    return lambda data: with_means(learned.run(learned.initial(), *signals(data.signals))[1])


RULES: Mapping[str, Mapping[int, FuzzyTerm]] = {
    "position": {0: "off", 1: "normal"},
    "flow": {0: "normal", 1: "off"},
    "both": {0: "off", 1: "off"},
    "process": {2: "off"},
}
"""Conclusions from the mean residuals of servo and flow and the outlet pressure."""


def _fuzzy(healthy: BenchmarkRun) -> Channels:
    places = [SCORES.index("servo.power"), SCORES.index("flow.mean"), SCORES.index("outlet")]
    columns = [MEMORIES.index(10.0) * len(SCORES) + place for place in places]
    usual = np.abs(healthy.symptoms[100:, columns]).max(axis=0)
    watch = Fuzzy(tuple((5 * usual).tolist()), RULES)
    harm = np.array([1.0, 1.0, 1.0, 1.0])
    return lambda data: watch.score(_alone(watch, data.symptoms[:, columns]), harm)[:, None]


TREE = (
    Rule("process changed", ("outlet",)),
    Rule("process changed", ("inlet",)),
    Rule("flow disturbed", ("flow.mean",), ("process changed",)),
    Rule("drive disturbed", ("servo.power",), ("process changed",)),
    Rule("valve or bypass or flow sensor", ("flow disturbed",), ("drive disturbed",)),
    Rule("position sensor or plug", ("flow disturbed", "drive disturbed")),
    Rule("servo or positioner", ("drive disturbed",), ("flow disturbed",)),
)
"""What an expert would say of the relations of the plant, symptoms taken over a minute."""


def _tree(healthy: BenchmarkRun) -> Channels:
    names = ("flow.mean", "servo.power", "inlet", "outlet")
    columns = [MEMORIES.index(60.0) * len(SCORES) + SCORES.index(name) for name in names]
    usual = np.abs(healthy.symptoms[100:, columns]).max(axis=0)
    # Every limit in steps: the statistic is the highest one at which some rule still fires.
    steps = np.geomspace(0.5, 50.0, 25)
    trees = [FaultTree(names, TREE, limit=float(step)) for step in steps]

    def channels(data: BenchmarkRun) -> Array:
        shares = data.symptoms[:, columns] / usual
        fired = np.column_stack([_alone(tree, shares).max(axis=1) for tree in trees])
        return (fired * steps).max(axis=1, keepdims=True)

    return channels


def _published(healthy: BenchmarkRun) -> Channels:
    """The observer of Chapter 5, its velocity from a Kalman filter: there is noise, and a second between samples."""
    observer = replace(chapter_5(), velocity=SteadyKalman(noise=1.5e-3 * _STROKE, jerk=1e-5, dt_s=1.0))

    def channels(data: BenchmarkRun) -> Array:
        t, run = np.arange(len(data.signals), dtype=float), data.signals
        said = observer.run(observer.initial(), t, _STROKE * run[:, X], run[:, CV])[1]
        return np.nan_to_num(np.abs(said.xi2) / np.maximum(said.rho, 1e-12), posinf=0.0)[:, None]

    return channels


def _watch(healthy: BenchmarkRun) -> Channels:
    """The calibrated observer with its relations of flow and pressures, as `detector.learn` makes it."""
    watch = calibrated(_measurements(healthy.signals[300:]), per_month=_LENIENT)

    def channels(data: BenchmarkRun) -> Array:
        state, loads = watch.initial(), np.empty((len(data.signals), 1))
        for k, row in enumerate(_measurements(data.signals)):
            state, judgement = watch.step(state, row)
            loads[k] = judgement.load
        return loads

    return channels


def _measurements(run: Array) -> Measurements:
    columns = {
        "position": _STROKE * run[:, X], "setpoint": run[:, CV], "upstream_pressure": SPANS["P1"] * run[:, P1],
        "downstream_pressure": SPANS["P2"] * run[:, P2], "mass_flow": SPANS["F"] / 3.6 * run[:, F],
    }  # fmt: skip
    return Measurements(np.arange(len(run), dtype=float), columns)


def _random(healthy: BenchmarkRun) -> Channels:
    """Uses no data: numbers drawn anew for every run, whose largest values are Gumbel's by construction."""

    def channels(data: BenchmarkRun) -> Array:
        seed = zlib.crc32(np.ascontiguousarray(data.signals).tobytes())
        return np.random.default_rng(seed).exponential(size=(len(data.signals), 1))

    return channels


def _bank(healthy: BenchmarkRun) -> Channels:
    return lambda data: data.symptoms


DETECTORS: Mapping[str, Detector] = {
    "bank": LearnedDetector("all symptoms of the learned plant, over five memories", _bank),
    **{one.name: _of_generator(one) for one in instances_of("detector.generators", EvaluatedGenerator)},
    "voting": LearnedDetector("position by sensor, model and flow, voting", _voting),
    "spectrum": LearnedDetector("power in bands of frequency", _spectrum),
    "luenberger": LearnedDetector("full-order Luenberger generator, linear plant", _full_order),
    "functional": LearnedDetector("functional Luenberger generators, linear plant", _functional),
    "parity": LearnedDetector("parity relations, linear plant: DFD and DFI", _parity),
    "kalman": LearnedDetector("Kalman innovations and matched filters, linear plant", _kalman),
    "estimation": LearnedDetector("recursive parameter estimation, ARX", _estimation),
    "neural": LearnedDetector("neural observer, linear in the weights", _neural),
    "fuzzy": LearnedDetector("fuzzy evaluation of servo and flow residuals", _fuzzy),
    "tree": LearnedDetector("fault tree over servo, flow and process symptoms", _tree),
    **FURTHER,
    "random": LearnedDetector("an alarm at random, at the same rate", _random),
    "watch": LearnedDetector("the calibrated observer with flow and pressure relations", _watch),
    "published": LearnedDetector("the observer of Chapter 5, slow samples", _published),
}
"""All detectors by name; the random alarm is the floor under all of them."""
