"""Rigs that impose the motion of a complete valve: nothing is missing, however stiff the bristles are.

The position's noise is many times that of the force once the bristles have answered to it.
"""

from __future__ import annotations

import numpy as np
import pytest
from traced_valves import imposed, recorded

from benchmarks.plants.cases import Case
from benchmarks.plants.recordings import recordings
from benchmarks.trace_ablation import Short
from identification import trace
from recordings import Array, Recording, Signal
from simulator import Excitation, Sensors, random_valve, simulate

COURSES = ("staircase:14", "sine:14", "multisine:12")
SAMPLING = ((250.0, 2e-4, 1e-3), (500.0, 1e-4, 1e-3), (500.0, 2e-5, 3e-4))
"""Rates [Hz], noise of the position as a share of the stroke, and of the force as a share of its span."""


def rig(seed: int, rate: float, position_noise: float, force_noise: float) -> list[Recording]:
    """What a rig records that moves a random valve as actuator and friction would."""
    valve, stroke = random_valve(seed)
    span = valve["spring.K"] * stroke
    sensors = Sensors(rate, position_noise=position_noise * stroke, force_noise=force_noise * span)
    return [
        imposed(simulate(valve, Excitation.parse(course), sensors, stroke=stroke, seed=i)[0])
        for i, course in enumerate(COURSES)
    ]


@pytest.mark.slow
def test_a_complete_rig_lacks_nothing_and_its_valve_comes_out_right():
    *fitted, held_out = rig(42, *SAMPLING[2])
    found, truth = trace(fitted, holdout=[held_out]), random_valve(42)[0]
    assert found.verdict == "none"
    for name, share in (("spring.K", 1e-3), ("lugre.fc", 2e-3), ("lugre.fs", 5e-3), ("lugre.sigma0", 5e-3)):
        assert found.values[name] == pytest.approx(truth[name], rel=share)


@pytest.mark.slow
def test_a_rig_whose_motion_is_noisy_lacks_nothing_if_one_model_explains_all_recordings():
    fitted, held_out, _ = recordings(Case(248148, rate=250.0, rig=True))
    found, truth = trace(fitted, holdout=held_out), random_valve(248148)[0]
    assert found.verdict == "none"
    assert "fitted to all recordings" in found.sentences()[0]
    assert 0.8 < found.values["lugre.sigma0"] / truth["lugre.sigma0"] < 0.95  # the noise makes the bristles softer


@pytest.mark.slow
@pytest.mark.parametrize("seed", [807806, 935220])
def test_noise_of_the_motion_is_no_effect(seed: int):
    fitted, held_out, _ = recordings(Case(seed, rig=True))
    assert trace(fitted, holdout=held_out).verdict == "none"


@pytest.mark.slow
def test_an_effect_that_a_rig_cannot_show_gets_no_other_name():
    *fitted, held_out = Short(51001, "backlash", rig=True).recordings()
    assert trace(fitted, holdout=[held_out]).verdict == "unlisted"


@pytest.mark.slow
def test_a_rig_at_250_hz_whose_motion_is_twice_as_noisy_lacks_nothing_either():
    fitted, held_out, _ = recordings(Case(694402, rate=250.0, noise=2.0, rig=True))
    assert trace(fitted, holdout=held_out).verdict == "none"


@pytest.mark.slow
@pytest.mark.parametrize("seed", [41, 43])
@pytest.mark.parametrize("sampling", SAMPLING[::2])
def test_a_complete_rig_with_stiff_bristles_lacks_nothing_either(seed: int, sampling: tuple[float, float, float]):
    *fitted, held_out = rig(seed, *sampling)
    assert trace(fitted, holdout=[held_out]).verdict == "none"


@pytest.mark.slow
@pytest.mark.parametrize(("rig", "size"), [(True, 1e-12), (True, 1e-9), (False, 1e-9)])
def test_times_that_are_moved_give_the_same_answer(rig: bool, size: float):
    made = recorded("hardening_spring", {"hardening_spring.k3": 3e6})[:3]
    made = [imposed(r) for r in made] if rig else list(made)
    rng = np.random.default_rng(1)
    plain, moved = (
        trace(some[:2], holdout=some[2:]) for some in (made, [_moved(r, rng.normal(0.0, size, len(r))) for r in made])
    )
    assert moved.effects_added == plain.effects_added == ("hardening_spring",)
    # by position static friction depends on how paths slip, which any change decides anew
    for name in ("hardening_spring.k3", "spring.K", "lugre.fc", *(["lugre.fs"] if rig else [])):
        assert moved.values[name] == pytest.approx(plain.values[name], rel=0.02)


def _moved(recording: Recording, by: Array) -> Recording:
    """A recording whose times are moved by so many seconds (n_samples,)."""
    columns = {name: recording[name].values for name in recording} | {"time": recording.time + by}
    signals = [Signal(n, values, recording[n].unit, recording[n].role) for n, values in columns.items()]
    return Recording.of(signals, plant=recording.plant, source="simulated", title="moved")


@pytest.mark.long
def test_valves_that_nobody_looked_at_lack_nothing():
    cases = [(seed, sampling) for seed in range(2301, 2309) for sampling in SAMPLING]
    verdicts = []
    for seed, sampling in cases:
        *fitted, held_out = rig(seed, *sampling)
        verdicts.append(trace(fitted, holdout=[held_out]).verdict)
        print(seed, *sampling, verdicts[-1], flush=True)
    assert np.mean([verdict == "none" for verdict in verdicts]) > 0.9
