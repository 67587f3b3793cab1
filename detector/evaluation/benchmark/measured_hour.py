"""Detectors on measured data of a plant: learned on the first third, alarms counted on the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from detector.evaluation.contract import BenchmarkRun
from detector.evaluation.detectors import DETECTORS
from detector.evaluation.learned import learn
from detector.evaluation.levels import alarms, calibrate, raised
from detector.evaluation.study import SAFETY
from recordings import Array, BadInput

BLOCK_S = 60
"""There is little data: levels are set from blocks of this length [s]."""

_SCALES = {1: 4000.0, 2: 4000.0, 3: 200.0, 6: 100.0, 4: 40.0}
"""Spans of the columns P1, P2 [kPa], T [degC], X [%], F [t/h], in the order of `SIGNALS` after CV."""

_ROWS = 11


def plant_hour(path: str | Path) -> Array:
    """The hour of actuator 3 as a run (3600, 6), columns `SIGNALS`, from its MATLAB file. Raises BadInput."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        held = loadmat(str(path))
    except (OSError, ValueError, NotImplementedError, MatReadError) as error:
        raise BadInput(str(path), f"it cannot be read ({error})", "give the plant hour as a MATLAB file") from None
    found = [np.asarray(one, float) for one in held.values() if np.shape(one)[:1] == (_ROWS,)]
    if not found:
        raise BadInput(str(path), f"no matrix of {_ROWS} rows is in it", "give the hour of actuator 3 of the benchmark")
    rows = found[0]
    return np.column_stack([rows[5] / 100, *(rows[place] / scale for place, scale in _SCALES.items())])


def count_alarms(run: Array, detectors: Sequence[str], rate_per_h: float) -> dict[str, int | str]:
    """Alarms after the first third by detector; in words why, where one cannot be learned from so little."""
    third, counts = len(run) // 3, dict[str, int | str]()
    for name in detectors:
        try:
            learned = learn([run[:third]], {name: DETECTORS[name]})
            levels = calibrate(learned.blocks(run[:third], BLOCK_S)[name], rate_per_h / SAFETY, BLOCK_S)
            statistic = replace(learned, levels={name: levels}).statistics(BenchmarkRun(run, learned.symptoms))[name]
            counts[name] = raised(alarms(statistic), third)
        except BadInput as error:
            counts[name] = str(error)
    return counts
