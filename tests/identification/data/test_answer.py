"""A force behind a positioner: how strongly it answers the motion is known from all slips together."""

import numpy as np
import pytest

from identification.data.answer import answering
from identification.data.force import Force, estimate_force
from identification.data.smoothing import Motion

NOISE, SECONDS = 1.0, 60.0
SLIP, USUAL = 0.02, 1e6
"""How long a slip lasts [s], and how strongly a force answers its way [N/(s m)]."""
Recorded = tuple[np.ndarray, np.ndarray, Motion]


def recorded(answers: float, seed: int = 1, rate: float = 100.0) -> Recorded:
    """Times [s], the force as it is recorded [N], and the motion: a slip of .1 to 1 mm every half second, in which the
    slope of the force falls by so many times the way, to come back in half a second. Noise is as in means of 10 ms.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(int(rate * SECONDS)) / rate
    v, slope = np.zeros(len(t)), np.zeros(len(t))
    for first in np.arange(0.5, SECONDS - 0.5, 0.5):
        way = rng.choice([-1, 1]) * rng.uniform(1e-4, 1e-3)
        v[int(rate * first) + np.arange(round(rate * SLIP))] = way / SLIP
        back = t - first
        slope -= answers * way * np.where((back > 0) & (back < 0.5), 1 - 2 * back, 0.0)
    motion = Motion(np.cumsum(v) / rate, v, np.gradient(v, t), v)
    noise = NOISE * np.sqrt(rate / 100.0)
    return t, np.cumsum(slope) / rate + rng.normal(0, noise, len(t)), motion


def smoothed(case: Recorded) -> tuple[Force, Force]:
    """The force smoothed without regard to the motion, and free to answer it."""
    t, u, motion = case
    smooth = estimate_force(t, u, NOISE * np.sqrt(1 / (100.0 * float(np.median(np.diff(t))))))
    return smooth, answering(t, u, smooth, motion)


def steps(force: Force, where: np.ndarray) -> float:
    """The median change of the slope in 10 ms [N/s], where the valve moves."""
    return float(np.sqrt(np.median(force.intensity[where]) * 0.01))


def moves(motion: Motion) -> np.ndarray:
    return np.asarray(np.abs(motion.v[1:] + motion.v[:-1]) > 0)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("rate", [100.0, 200.0, 500.0])
def test_an_answer_shows_that_the_noise_of_a_sample_hides(rate: float, seed: int) -> None:
    t, u, motion = recorded(USUAL, seed, rate)  # 100 to 1000 N/s, where the noise of means of 10 ms makes 250 N/s
    smooth, free = smoothed((t, u, motion))
    usual = USUAL * SLIP * np.median(np.abs(motion.v[motion.v != 0]))
    assert (free.intensity >= smooth.intensity).all()
    assert 1.25 * steps(smooth, moves(motion)) < steps(free, moves(motion)) < 1.1 * usual
    assert steps(free, moves(motion)) > 0.5 * usual
    assert (free.std >= smooth.std * (1 - 1e-5)).all()


def test_a_force_that_does_not_answer_mostly_stays_as_smooth_as_it_is() -> None:
    """One standard error lets through a sixth of what is nothing, by chance."""
    pairs = [smoothed(recorded(0.0, seed)) for seed in range(1, 13)]
    assert sum(not np.array_equal(free.intensity, smooth.intensity) for smooth, free in pairs) <= 3


def test_what_rests_is_left_alone() -> None:
    t, u, motion = case = recorded(USUAL)
    smooth, free = smoothed(case)
    rests = np.convolve(motion.v != 0, np.ones(9), "same")[1:] == 0
    assert rests.mean() > 0.5
    assert (free.intensity[rests] == smooth.intensity[rests]).all()
    still = Motion(*(np.zeros(len(t)) for _ in range(4)))
    assert (answering(t, u, smooth, still).intensity == smooth.intensity).all()


def test_corners_of_a_set_point_are_no_answer() -> None:
    """A corner is many times as large as the answer to the slip that it comes with."""
    t, u, motion = recorded(USUAL)
    bent = u.copy()
    for first in np.arange(0.5, SECONDS - 0.5, 6.0):  # with a twelfth of the slips
        bent += np.where(t > first, 2e4 * np.minimum(t - first, 0.1), 0.0)
    away = moves(motion) & (t[1:] % 6.0 > 1.0)
    (_, known), (_, misled) = smoothed((t, u, motion)), smoothed((t, bent, motion))
    assert steps(misled, away) < 3 * steps(known, away)
