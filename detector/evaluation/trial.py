"""What is measured in one trial: plain values that fit in JSON."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from detector.evaluation.benchmark.runs import SIGNALS, Setting, simulate
from detector.evaluation.contract import BenchmarkRun
from detector.evaluation.isolation.diagnosis import Diagnosis, feature_vectors
from detector.evaluation.learned import BANK, SETTLE_S, Learned
from detector.evaluation.levels import raised
from detector.evaluation.performance import Zone, indices, misisolation
from recordings import Array
from simulator.damadics import Form, Scenario

Json = dict[str, Any]

POINTS = 250
"""Points of each curve that is kept for drawing."""

RANKED_AFTER_S = 300
"""The first ranking that counts is made so long after the alarm [s]; the last at the end of the run."""


def zone(what: Scenario, seconds: int) -> Zone:
    """ton, tfrom, thor [s] of a scenario of which `seconds` were simulated."""
    fault = what.faults[0]
    return Zone(int(what.ton), int(fault.start_s), min(int(what.thor), seconds), fault.development_s, fault.strength)


def scored(what: Scenario, run: Array, learned: Learned, draw: bool) -> Json:
    """Indices of every detector on one run, the diagnosis of the bank, and curves when they are to be drawn.

    run (n_seconds, n_signals): columns as `SIGNALS` names them.
    """
    data, where = BenchmarkRun(run, learned.symptoms), zone(what, len(run))
    statistics, alarm = learned.alarms(data)
    found: Json = {"seconds": len(run), "detectors": {}}
    for name, one in alarm.items():
        healthy = raised(one[: where.tfrom], where.ton)
        found["detectors"][name] = asdict(indices(one, where)) | {"false": healthy}
    if BANK in alarm and learned.diagnosis is not None:
        found["diagnosis"] = diagnosed(what.faults[0].number, data, alarm[BANK], learned.diagnosis, where)
    if draw:
        found["curves"] = curves(run, statistics)
    return found


def diagnosed(fault: int, data: BenchmarkRun, alarm: NDArray[np.bool_], known: Diagnosis, where: Zone) -> Json:
    """Rankings some minutes after the alarm and at the end, and the isolation indices of the group named first.

    fault : its number; alarm (n_seconds,) : whether the bank raises one, second by second.
    """
    live = alarm.copy()
    live[: where.tfrom] = False
    at, rows = feature_vectors(data.signals, data.symptoms, live)
    if not len(at):
        return {"ranked": [], "last": []}
    row = min(int(np.searchsorted(at, at[0] + RANKED_AFTER_S)), len(at) - 1)
    flagged = known.flagged(data.signals, data.symptoms, alarm)
    mine = np.isin(flagged, known.members(fault))
    isolation = indices(mine, where)
    return {
        "ranked": known.ranked(rows[row])[:5],
        "last": known.ranked(rows[-1])[:5],
        "isolation": asdict(isolation),
        "rmi": misisolation((flagged > 0).astype(np.int64) - (mine & (flagged > 0)), where),
        "dacc": 1 / len(known.members(fault)) if isolation.detected else 0.0,
    }


def curves(run: Array, statistics: dict[str, Array]) -> Json:
    """Lowest and highest of the signals, and the largest statistic, within each of `POINTS` stretches, rounded.

    run (n_seconds, n_signals) : shares of the spans; statistics : (n_seconds,) by detector, 1 at the threshold.
    """
    width = max(1, -(-len(run) // POINTS))
    starts = np.arange(0, len(run), width)
    kept: Json = {"t": starts.tolist()}
    for name in ("CV", "X", "F"):
        one = run[:, SIGNALS.index(name)]
        ends = {"low": np.minimum.reduceat(one, starts), "high": np.maximum.reduceat(one, starts)}
        kept[name] = {end: np.round(values, 4).tolist() for end, values in ends.items()}
    kept["statistics"] = {
        name: np.round(np.maximum.reduceat(np.clip(one, 1e-3, 1e4), starts), 4).tolist()
        for name, one in statistics.items()
    }
    return kept


def false_alarms(run: Array, learned: Learned) -> dict[str, int]:
    """How many alarms each detector raises on a fault-free run (n_seconds, n_signals)."""
    _, alarm = learned.alarms(BenchmarkRun(run, learned.symptoms))
    return {name: raised(one, SETTLE_S) for name, one in alarm.items()}


def detectability(
    what: Scenario, form: Form, seed: int, seconds: int, noise_x: float, noise_f: float
) -> dict[str, float]:
    """How much a fault moves X and F: the run less the same run without the fault, noise alike; over the deviation of
    the residual, for a second (`x`, `f`) and for all seconds together by a perfectly matched filter (`all`).

    seconds : length of both runs [s]; noise_x, noise_f : those deviations, as shares of the spans of X and F.
    """
    setting, first = Setting(form, seed), what.faults[0]
    with_it = simulate(what.faults, seconds, setting)[1]
    without = simulate((replace(first, strength=0.0),), seconds, setting)[1]
    n = min(len(with_it), len(without))
    moved = (with_it[:n] - without[:n])[int(first.start_s) :]
    x, f = moved[:, SIGNALS.index("X")] / noise_x, moved[:, SIGNALS.index("F")] / noise_f
    together = float(np.sqrt(np.sum(x**2) + np.sum(f**2)))
    return {"x": float(np.sqrt(np.mean(x**2))), "f": float(np.sqrt(np.mean(f**2))), "all": together}
