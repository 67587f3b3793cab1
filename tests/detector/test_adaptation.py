"""The observer in service: its laws run, follow what drifts, cannot follow a fault further than is stated, and rest
where nothing of the valve shows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from watched_valve import TENTH, seen

from detector import Calibration, Kalman, Measurements, Start, SteadyKalman, calibrate, learn, regressors
from detector.observer.calibration import DEAF_BELOW, RAISED
from recordings import BadInput
from simulator.damadics import Fault
from studies import adapting

NAMES = ("alpha1", "alpha4", "alpha5")


@pytest.fixture(scope="module")
def healthy() -> Measurements:
    return seen(300.0, seed=1)


@pytest.fixture(scope="module")
def calibration(healthy) -> Calibration:
    return calibrate(healthy)


@pytest.fixture(scope="module")
def with_laws() -> adapting.LearnedObserver:
    return adapting.observers(1)[0]


def drifted(calibration: Calibration, factor: float, seconds: float, seed: int = 1):
    """Time, position and input of a valve that the calibration fits, but whose spring is another one."""
    t = TENTH * np.arange(round(seconds / TENTH))
    u = 0.4 * calibration.top_input * (np.sin(2 * np.pi * t / 17.0) + np.sin(2 * np.pi * t / 41.0))
    x, v = np.zeros(len(t)), 0.0
    for i in range(1, len(t)):
        a = calibration.alpha4 * u[i] - calibration.alpha1 * v - factor * calibration.alpha5 * x[i - 1]
        v += TENTH * a
        x[i] = x[i - 1] + TENTH * v
    return t, x + calibration.noise * np.random.default_rng(seed).standard_normal(len(t)), u


def test_the_networks_make_a_threshold_that_goes_with_the_speed(calibration, healthy):
    observer = calibration.compiled
    said = observer.run(observer.initial(), *calibration.scaled(healthy))[1]
    assert max(calibration.w1) > 0
    assert max(calibration.w2) > 0
    assert said.rho.max() > 1.1 * said.rho.min()
    late = said.time_s > said.time_s[0] + calibration.settle_s
    assert np.abs(said.xi2 / said.rho)[late].max() < 1.0


def test_the_laws_follow_what_drifts_and_less_of_it_is_left(calibration):
    data = drifted(calibration, 1.2, 3 * 3600.0)
    late = slice(-18_000, None)
    left = {}
    for adapts in (True, False):
        observer = replace(calibration, adapts=adapts).compiled
        state, said = observer.run(observer.initial(), *data)
        left[adapts] = float(np.std(said.xi2[late]))
        moved = [abs(state.estimates[name] - getattr(calibration, name)) for name in NAMES]
        assert (max(moved) > 0) == adapts
    assert left[True] < left[False]


def test_whatever_comes_the_laws_stay_within_their_stated_sets(calibration):
    """Random walks of any size, and no alarm to freeze them: what they can do is stated, and no more."""
    random = np.random.default_rng(3)
    n = 20_000
    t, u = TENTH * np.arange(n), calibration.top_input * random.uniform(-1.0, 1.0, n)
    x = calibration.top_position * np.sin(np.cumsum(random.normal(size=n)) * 0.2)
    free = replace(calibration.compiled, freeze=False, weight_gain=calibration.weight_gains(1e3))
    state = free.run(free.initial(), t, x, u)[0]
    speeds = np.linspace(0.0, calibration.top_speed, 40)
    flat = np.concatenate([speeds, speeds])
    rho = [phi(calibration, estimates, flat) for estimates in (state, calibration.compiled.initial())]
    assert (rho[0] > 1.05 * rho[1]).all()
    assert (rho[0] <= rho[1] + RAISED * calibration.least_phi * (1.0 + 1e-9)).all()
    tops = (calibration.top_speed, calibration.top_input, calibration.top_position)
    taken = sum(
        abs(state.estimates[name] - getattr(calibration, name)) * top for name, top in zip(NAMES, tops, strict=True)
    )
    assert taken <= (DEAF_BELOW - 1.0 - RAISED) * calibration.least_phi * (1.0 + 1e-9)


def phi(calibration: Calibration, state, speeds: np.ndarray) -> np.ndarray:
    """Phi of a state at speeds (n,), from the estimates and the networks alone."""
    first, second = calibration.networks
    e1, b1 = state.estimates["e1"], state.estimates["b1"]
    return np.array([
        v * float(state.w1 @ regressors(first, [v, v])) + float(state.w2 @ regressors(second, [v])) + v * e1 + b1
        for v in speeds.tolist()
    ])  # fmt: skip


def test_no_law_runs_at_rest_nor_in_an_alarm_nor_right_after_a_gap(calibration):
    t = TENTH * np.arange(2000)
    resting, pushed = np.full(len(t), 0.3), np.full(len(t), 0.3)
    observer = calibration.compiled
    state = observer.run(observer.initial(), t, resting, pushed)[0]
    assert state.estimates == observer.initial().estimates
    t, x, u = drifted(calibration, 1.2, 60.0)
    early = t < calibration.settle_s - TENTH
    state = observer.run(observer.initial(), t[early], x[early], u[early])[0]
    assert state.estimates == observer.initial().estimates
    started = observer.run(observer.initial(), t[:300], x[:300], u[:300])[0]
    after, said = observer.run(started, t[300:], -8.0 * x[300:], u[300:])
    assert said.alarm.any()
    assert after.estimates != started.estimates  # between the alarms of the observer itself; those of a watch last


def test_a_watch_that_has_an_alarm_learns_nothing_from_it(healthy):
    watch = learn(healthy)
    state, frozen = watch.initial(), []
    for row in seen(90.0, Fault(13, 0.75, start_s=30.0), seed=6):
        before = state
        state, _ = watch.step(state, row)
        if before.alarm:
            frozen.append(state.observer.estimates == before.observer.estimates)
    assert len(frozen) > 100
    assert all(frozen)


def test_one_valve_has_filterpys_velocity_and_the_compiled_form_is_held_against_it(calibration):
    assert isinstance(calibration.observer.velocity, Kalman)
    assert isinstance(calibration.compiled.velocity, SteadyKalman)
    data = seen(100.0, seed=4)
    t, x, u = calibration.scaled(data)
    one, other = (
        observer.run(observer.initial(), t, x, u)[1] for observer in (calibration.observer, calibration.compiled)
    )
    late = t > t[0] + 10.0
    assert np.std((one.xi2 - other.xi2)[late]) < 0.02 * np.std(one.xi2[late])
    random = np.random.default_rng(0)
    jittered = t + 0.02 * random.uniform(-1.0, 1.0, len(t))
    keep = random.random(len(t)) > 0.2
    one, other = (
        observer.run(observer.initial(), jittered[keep], x[keep], u[keep])[1]
        for observer in (calibration.observer, calibration.compiled)
    )
    late = jittered[keep] > t[0] + 10.0
    assert np.std((one.xi2 - other.xi2)[late]) < 0.5 * np.std(one.xi2[late])


def test_weights_that_do_not_fit_the_networks_are_refused(calibration):
    with pytest.raises(BadInput, match="weights"):
        replace(calibration.compiled, start=Start(w2=(1.0,))).initial()


@pytest.mark.parametrize("hours", [1.0, pytest.param(24.0, marks=pytest.mark.long)], ids=["an hour", "a day"])
@pytest.mark.parametrize("fault", [{"lugre.fc": 10.0, "lugre.fs": 10.0}, {"spring.K": 0.6}], ids=["friction", "spring"])
def test_a_fault_that_grows_slowly_is_not_learned_away(fault, hours, with_laws):
    """The laws have all the time there is; what they may follow is bounded, and the fault is found while it grows."""
    by_s = 3600.0 * hours
    run = with_laws.run(adapting.simulated(by_s, 2, adapting.growing(fault, by_s)))
    assert run.alarm_s is not None
    quiet = with_laws.run(adapting.simulated(min(by_s, 7200.0), 3))
    assert quiet.alarm_s is None
