"""What every approximator and every velocity filter gives an observer, whatever the samples are."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from detector import (
    AlarmRule,
    Bounds,
    HighOrder,
    HighPass,
    Kalman,
    Measured,
    Observer,
    ObserverState,
    RadialBasis,
    SampleVerdict,
    Screening,
    ShiftedSigmoids,
    SteadyKalman,
    regressors,
)
from recordings import BadInput

FIRST = {
    "high order": HighOrder(order=2, inputs=2, m=1.41, l=-10.0, c=0.6, lam=-2.1),
    "radial": RadialBasis([[-0.5, 0.5], [0.0, 0.0], [0.5, 0.5]], width=0.4),
    "sigmoids": ShiftedSigmoids((-0.5, 0.0, 0.5), slope=8.0, inputs=2),
}
SECOND = {
    "high order": HighOrder(order=5, m=0.8, l=-4.0, c=2.1, lam=-1.5),
    "radial": RadialBasis((0.0, 0.5), width=0.4),
    "sigmoids": ShiftedSigmoids((0.0, 0.5), slope=8.0),
}
VELOCITIES = {
    "measured": Measured(),
    "high pass": HighPass(2e-3),
    "kalman": Kalman(noise=1e-4, jerk=1.0),
    "steady": SteadyKalman(noise=1e-4, jerk=1.0, dt_s=0.01),
}
OBSERVERS = [
    *(Observer(s1=FIRST[name], s2=SECOND[name]) for name in FIRST),
    *(Observer(velocity=velocity) for velocity in VELOCITIES.values()),
    Observer(sigm="sat", projection="smooth", dead_zone=0.8, freeze=True, rule=AlarmRule(3, latch=True, settle_s=0.1)),
    Observer(law_b1="printed", least_phi=-math.inf, rule=AlarmRule(residual="printed"), delta=1e-3),
]
NAMES = [*FIRST, *VELOCITIES, "saturation", "printed"]
every_observer = pytest.mark.parametrize("observer", OBSERVERS, ids=NAMES)


def ride(n=400, dt=0.01, seed=0):
    """Swinging positions with noise, their velocity, an input, and now and then something wrong."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(dt * rng.uniform(0.5, 1.5, n))
    x, v, u = 0.3 * np.sin(2 * t), 0.6 * np.cos(2 * t), np.sign(np.sin(0.7 * t))
    quality = np.zeros(n, int)
    x[50], u[60], v[70], x[80], t[90] = np.nan, np.inf, np.nan, 1e30, t[89]
    quality[100:103] = [SampleVerdict.STALE, SampleVerdict.BAD, SampleVerdict.BAD]
    t[200:] += 10.0
    return Ride(t, x + 1e-4 * rng.standard_normal(n), u, v, quality)


class Ride(NamedTuple):
    """The arguments of a run, in order."""

    time_s: np.ndarray
    position: np.ndarray
    input: np.ndarray
    velocity: np.ndarray
    quality: np.ndarray

    def part(self, begin=0, end=None):
        return Ride(*(column[begin:end] for column in self))


def ran(observer, state, ride, **more):
    """The observer over a ride."""
    return observer.run(state, *ride[:4], quality=ride.quality, **more)


def same(one, other):
    """Equal in every bit, NaN equal to itself."""
    return np.array_equal(one.output, other.output) and np.array_equal(one.verdict, other.verdict)


@every_observer
def test_step_by_step_in_blocks_and_at_once_give_the_same_bits(observer):
    samples, start = ride(), observer.initial()
    final, whole = ran(observer, start, samples)
    state, parts = start, []
    for begin, end in ((0, 1), (1, 150), (150, 150), (150, 400)):
        state, decisions = ran(observer, state, samples.part(begin, end))
        parts.append(decisions.output)
    assert np.array_equal(np.concatenate(parts), whole.output)
    assert state.as_dict() == final.as_dict()
    state = start
    for i in range(len(samples.time_s)):
        fields = [column[i] for column in (samples.time_s, samples.position, samples.input, samples.velocity)]
        state, decision = observer.step(state, *fields, samples.quality[i])
        assert decision == whole[i]


@every_observer
def test_nothing_given_is_changed_and_a_repeat_is_the_same(observer):
    samples, start = ride(), observer.initial()
    kept, before = ride(), start.as_dict()
    _, first = ran(observer, start, samples)
    _, second = ran(observer, start, samples)
    assert same(first, second)
    assert start.as_dict() == before
    for name in ("time_s", "position", "input", "velocity", "quality"):
        assert np.array_equal(getattr(samples, name), getattr(kept, name), equal_nan=True)


@every_observer
def test_a_state_survives_json(observer):
    samples = ride()
    state, _ = ran(observer, observer.initial(), samples.part(0, 250))
    back = ObserverState.from_dict(json.loads(json.dumps(state.as_dict())))
    assert same(*(ran(observer, one, samples.part(250))[1] for one in (state, back)))


wild = st.one_of(
    st.floats(-2.0, 2.0), st.floats(allow_nan=True, allow_infinity=True), st.sampled_from([0.0, 1e9, -1e9, 1e-300])
)
odd_steps = st.sampled_from([0.0, -1.0, 1e-9, 5.0, 1e12, math.nan])
streams = st.lists(
    st.tuples(st.one_of(st.floats(1e-4, 1.0), odd_steps), wild, wild, wild),
    min_size=1, max_size=40,
)  # fmt: skip


@every_observer
@settings(max_examples=40, deadline=None, derandomize=True)
@given(stream=streams, scale=st.sampled_from([1e-4, 1.0]))
def test_random_streams_leave_everything_finite(observer, stream, scale):
    steps, x, u, v = (np.array(row, float) for row in zip(*stream, strict=True))
    final, decisions = observer.run(observer.initial(), np.nancumsum(scale * steps), x, u, v)
    assert np.isfinite(decisions.output).all()
    assert all(np.isfinite(row).all() for row in (final.core, final.screening, final.filter))


@every_observer
@pytest.mark.parametrize("dt", [1e-4, 1e-3, 1e-2, 1e-1, 1.0])
@pytest.mark.parametrize("k2", [200.0, 1e5])
def test_any_sampling_time_is_stable(observer, dt, k2):
    """The residual stays below what the largest acceleration could make of it, up to k2 Ts = 1e5."""
    n = 2000
    t = dt * np.arange(n)
    w = min(2.0, 0.3 / dt)
    x, v, u = 0.3 * np.sin(w * t), 0.3 * w * np.cos(w * t), np.cos(w * t)
    fast = replace(observer, k2=k2)
    if isinstance(observer.velocity, SteadyKalman):
        fast = replace(fast, velocity=replace(observer.velocity, dt_s=dt))
    _, decisions = fast.run(fast.initial(), t, x, u, v)
    quiet = np.abs(decisions.xi2[n // 2 :])
    assert quiet.max() < 20.0 * (0.3 * w * w + 0.3 * w + 1.3) / k2
    assert quiet.max() > 0.0


@every_observer
def test_bad_samples_are_passed_over_and_reported(observer):
    samples = ride()
    _, decisions = ran(observer, observer.initial(), samples)
    said = {i: SampleVerdict(decisions.verdict[i]).name for i in (0, 50, 60, 80, 90, 100, 101, 200)}
    assert said == {0: "START", 50: "NOT_FINITE", 60: "NOT_FINITE", 80: "OUTLIER", 90: "STALE", 100: "STALE",
                    101: "BAD", 200: "GAP"}  # fmt: skip
    assert decisions[50].xi2 == decisions[49].xi2
    assert decisions[200].xi2 == 0.0
    needed = "NOT_FINITE" if isinstance(observer.velocity, Measured) else "USED"
    assert SampleVerdict(decisions.verdict[70]).name == needed


def test_a_velocity_that_jumps_is_an_outlier_until_it_stays():
    observer = Observer(screening=Screening(top_speed=2.0))
    position = np.array([0.0, 0.0, 5.0, 0.0, 5.0, 5.0, 5.0, 5.0, 5.0])
    _, decisions = observer.run(observer.initial(), 0.1 * np.arange(9), position, np.zeros(9), np.zeros(9))
    names = [SampleVerdict(v).name for v in decisions.verdict]
    assert names == ["START", "USED", "OUTLIER", "USED", *["OUTLIER"] * 3, "GAP", "USED"]


def test_a_clock_that_is_set_back_does_not_silence_the_detector():
    observer = Observer()
    _, decisions = observer.run(observer.initial(), [0.0, 0.1, 1e6, 0.3, 0.4], *np.zeros((3, 5)))
    assert [SampleVerdict(v).name for v in decisions.verdict] == ["START", "USED", "GAP", "GAP", "USED"]


@pytest.mark.parametrize("projection", ["radial", "smooth"])
def test_projection_keeps_every_estimate_in_its_set(projection):
    bounds = Bounds(w1=0.02, w2=0.03, e1=0.004, b1=0.005, alpha1=1.01, alpha4=1.02, alpha5=1.03)
    observer = Observer(projection=projection, bounds=bounds, weight_gain=50.0, alpha_gain=50.0)
    state, decisions = ran(observer, observer.initial(), ride(4000), history=True)
    assert np.linalg.norm(state.w1) <= bounds.w1 * (1 + 1e-12)
    assert np.linalg.norm(state.w2) <= bounds.w2 * (1 + 1e-12)
    for name in ("e1", "b1", "alpha1", "alpha4", "alpha5"):
        past = decisions.past(name)
        assert np.abs(past).max() <= getattr(bounds, name) * (1 + 1e-12)
        assert name in ("e1", "b1") or past.min() > 0
    assert np.linalg.norm(state.w2) > 0.8 * bounds.w2


def test_the_smooth_form_slows_down_before_the_border():
    bounds = Bounds(b1=0.01)
    course = []
    for kind in ("radial", "smooth"):
        observer = Observer(projection=kind, bounds=bounds, weight_gain=5.0, alpha_gain=0.0)
        course.append(ran(observer, observer.initial(), ride(), history=True)[1])
    radial, smooth = (one.past("b1") for one in course)
    apart = np.flatnonzero(radial != smooth)
    assert radial[apart[0]] > smooth[apart[0]] > (1 - 0.1) * bounds.b1
    assert radial.max() == bounds.b1
    assert np.argmax(radial >= 0.999 * bounds.b1) < np.argmax(smooth >= 0.999 * bounds.b1)


def used(observer):
    return ran(observer, observer.initial(), ride())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"k2": 0.0}, "k2"),
        ({"delta": math.nan}, "delta"),
        ({"s1": SECOND["radial"]}, "inputs"),
        ({"s2": HighOrder(order=0)}, "order"),
        ({"s2": RadialBasis((0.0,), width=-1.0)}, "width"),
        ({"velocity": SteadyKalman(1e-4, -1.0, 0.01)}, "jerk"),
        ({"velocity": HighPass(0.0)}, "tau_s"),
    ],
)
def test_constants_that_cannot_be_are_refused_in_words(change, said):
    with pytest.raises(BadInput, match=said):
        used(replace(Observer(), **change))


def test_other_peoples_states_and_rows_are_refused():
    small = Observer(s2=HighOrder(order=1))
    with pytest.raises(BadInput, match="another observer"):
        ran(small, Observer().initial(), ride())
    with pytest.raises(BadInput, match="learn anew"):
        ObserverState.from_dict({"core": [1.0]})
    with pytest.raises(BadInput, match="equal length"):
        small.run(small.initial(), [0.0, 1.0], [0.0], [0.0, 1.0])
    with pytest.raises(BadInput, match="it takes 1"):
        regressors(SECOND["radial"], [0.0, 1.0])


def test_regressors_are_what_the_source_says():
    s1, s2 = FIRST["high order"], SECOND["high order"]
    a, b = (1.41 / (1 + math.exp(10.0 * (v - 0.6))) - 2.1 for v in (-0.3, 0.3))
    s = 0.8 / (1 + math.exp(4.0 * (0.3 - 2.1))) - 1.5
    assert regressors(s1, [-0.3, 0.3]) == pytest.approx([a, b, a * a, a * b, b * b], rel=1e-14)
    assert regressors(s2, [0.3]) == pytest.approx([s, s**2, s**3, s**4, s**5], rel=1e-14)
    bells = regressors(FIRST["radial"], [0.5, 0.5])
    assert bells == pytest.approx([math.exp(-1 / 0.32), math.exp(-0.5 / 0.32), 1.0])
