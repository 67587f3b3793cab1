"""Many observers at once give the bits that each one gives alone; and compiled code is found by the next process."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from detector import Calibration, Fleet
from recordings import BadInput


def calibrations(n: int) -> list[Calibration]:
    random = np.random.default_rng(0)
    constants = ((*random.uniform(0.2, 0.6, 3), random.uniform(0.02, 1.5)) for _ in range(n))
    return [
        Calibration("setpoint", 0.0, 1.0, 0.0, 1.0, *one, noise=1e-3, jerk=0.1, dt_s=0.1, error=0.1)
        for one in constants
    ]


def test_a_fleet_decides_as_each_observer_does_alone_bit_for_bit():
    n, length, random = 7, 400, np.random.default_rng(1)
    ones = calibrations(n)
    fleet = Fleet(ones)
    time = np.cumsum(random.choice([0.1, 0.1, 0.1, 0.13, 0.09, 3.0], length, p=[0.3, 0.3, 0.3, 0.04, 0.05, 0.01]))
    position, u = (np.cumsum(random.normal(size=(length, n)), axis=0) * 0.01 for _ in range(2))
    position[random.random((length, n)) < 0.01] = np.nan
    position[random.random((length, n)) < 0.01] = 1e12
    position[100:106] += 1e3
    state, said = fleet.initial(), []
    for k in range(length):
        state, one = fleet.step(state, np.full(n, time[k]), position[k], u[k])
        said.append(one)
    for i, calibration in enumerate(ones):
        observer = calibration.compiled
        alone = observer.run(observer.initial(), time, position[:, i], u[:, i])[1]
        for name in ("xi2", "rho", "alarm", "verdict"):
            assert np.array_equal(getattr(alone, name), [getattr(one, name)[i] for one in said]), (i, name)
    assert any(one.alarm.any() for one in said)


def test_a_step_of_a_fleet_leaves_its_argument_alone():
    fleet = Fleet(calibrations(2))
    state = fleet.initial()
    before = state.copy()
    after, _ = fleet.step(state, np.zeros(2), np.ones(2), np.ones(2))
    assert np.array_equal(state, before)
    assert not np.array_equal(after, before)
    with pytest.raises(BadInput, match="no valve"):
        Fleet([])


STEP = """
import sys, numba
from detector import HighOrder, regressors
compiled = []
original = numba.core.dispatcher._FunctionCompiler.compile
def compile(self, *arguments):
    compiled.append(self.py_func.__name__)
    return original(self, *arguments)
numba.core.dispatcher._FunctionCompiler.compile = compile
found = regressors(HighOrder(order=3, inputs=2), [0.1, 0.2])
print(len(compiled), *(value.hex() for value in found.tolist()))
"""


@pytest.mark.slow
def test_the_second_process_compiles_nothing_and_gets_the_same_numbers(tmp_path):
    environment = {**os.environ, "BRISTLE_CACHE": str(tmp_path / "cache")}

    def run() -> list[str]:
        command = [sys.executable, "-c", STEP]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()

    first, second = run(), run()
    assert int(first[0]) > 0
    assert int(second[0]) == 0
    assert first[1:] == second[1:]
