"""A force behind a positioner: how strongly it answers the motion is known from all slips together."""

import numpy as np
import pytest

from identification.data.answer import answering
from identification.data.force import Force, estimate_force
from identification.data.smoothing import Motion

NOISE, RATE, SECONDS = 1.0, 100.0, 60.0
Recorded = tuple[np.ndarray, np.ndarray, Motion]


def recorded(answers: float, seed: int = 1) -> Recorded:
    """Times [s], the force as it is recorded [N], and the motion: a slip of .1 to 1 mm every half second, in which the
    slope of the force falls by so many times the way [N/(s m)], to come back in half a second.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(int(RATE * SECONDS)) / RATE
    v, slope = np.zeros(len(t)), np.zeros(len(t))
    for first in np.arange(0.5, SECONDS - 0.5, 0.5):
        way = rng.choice([-1, 1]) * rng.uniform(1e-4, 1e-3)
        v[int(RATE * first) + np.arange(2)] = way * RATE / 2
        back = t - first
        slope -= answers * way * np.where((back > 0) & (back < 0.5), 1 - 2 * back, 0.0)
    motion = Motion(np.cumsum(v) / RATE, v, np.gradient(v, t), v)
    return t, np.cumsum(slope) / RATE + rng.normal(0, NOISE, len(t)), motion


def smoothed(case: Recorded) -> tuple[Force, Force]:
    """The force smoothed without regard to the motion, and free to answer it."""
    t, u, motion = case
    smooth = estimate_force(t, u, NOISE)
    return smooth, answering(t, u, smooth, motion)


def steps(force: Force, where: np.ndarray) -> float:
    """The median step of the slope from sample to sample [N/s], where the valve moves."""
    return float(np.sqrt(np.median(force.intensity[where] / RATE)))


def moves(motion: Motion) -> np.ndarray:
    return np.asarray(np.abs(motion.v[1:] + motion.v[:-1]) > 0)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_answer_shows_that_the_noise_of_a_sample_hides(seed: int) -> None:
    case = recorded(5e5, seed)  # 50 to 500 N/s, where the noise of the samples makes 250 N/s
    smooth, free = smoothed(case)
    usual = 5e5 * 2 * np.median(np.abs(case[2].v[case[2].v != 0])) / RATE
    assert (free.intensity >= smooth.intensity).all()
    assert steps(smooth, moves(case[2])) < 0.5 * usual
    assert steps(free, moves(case[2])) == pytest.approx(usual, rel=0.35)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_force_that_does_not_answer_is_hardly_any_freer(seed: int) -> None:
    case = recorded(0.0, seed)
    _, free = smoothed(case)
    assert steps(free, moves(case[2])) < 0.5 * np.sqrt(6) * NOISE * RATE  # of the noise of such a step


def test_what_rests_is_left_alone() -> None:
    t, u, motion = case = recorded(5e5)
    smooth, free = smoothed(case)
    rests = np.convolve(motion.v != 0, np.ones(9), "same")[1:] == 0
    assert rests.mean() > 0.5
    assert (free.intensity[rests] == smooth.intensity[rests]).all()
    still = Motion(*(np.zeros(len(t)) for _ in range(4)))
    assert (answering(t, u, smooth, still).intensity == smooth.intensity).all()


def test_corners_of_a_set_point_are_no_answer() -> None:
    """A corner is many times as large as the answer to the slip that it comes with."""
    t, u, motion = recorded(5e5)
    bent = u.copy()
    for first in np.arange(0.5, SECONDS - 0.5, 6.0):  # with a twelfth of the slips
        bent += np.where(t > first, 2e4 * np.minimum(t - first, 0.1), 0.0)
    away = moves(motion) & (t[1:] % 6.0 > 1.0)
    (_, known), (_, misled) = smoothed((t, u, motion)), smoothed((t, bent, motion))
    assert steps(misled, away) < 3 * steps(known, away)
