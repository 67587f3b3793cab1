"""The source's statements where they fail, and the corrected ones where they have to hold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from detector import theory
from recordings import BadInput

K2, ALPHA1 = 200.0, math.sqrt(2.0) + 0.4
K = K2 + ALPHA1


def residual(time, a, b, begin=0.0):
    """xi2 with constant A and B: the solution of xi2' = -k xi2 + A + B."""
    return begin * np.exp(-K * time) + (a + b) / K * -np.expm1(-K * time)


def test_the_printed_bound_promises_a_detection_that_never_comes():
    sizes = {"b_least": 1.8, "a_most": 0.4, "phi": 1.39, "k2": K2, "alpha1": ALPHA1}
    assert theory.detection_bound(**sizes, form="printed") == pytest.approx(0.0279, abs=5e-5)
    assert theory.detection_bound(**sizes) == math.inf
    assert residual(np.linspace(0.0, 10.0, 1001), -0.4, 1.8).max() < 1.39 / K2


def error_rate(t, xi2, a, b, rate):
    """The worst case: A against a fault of profile 1 - exp(-rate t)."""
    return -K * xi2 - a + b * (1.0 if math.isinf(rate) else -math.expm1(-rate * t))


@pytest.mark.parametrize("seed", range(20))
def test_no_fault_within_the_conditions_is_detected_later_than_the_corrected_bound(seed):
    rng = np.random.default_rng(seed)
    b, a, phi = rng.uniform(2.0, 5.0), rng.uniform(0.0, 0.5), rng.uniform(0.2, 1.2)
    for rate in (math.inf, rng.uniform(5.0, 500.0)):
        bound = theory.detection_bound(b_least=b, a_most=a, phi=phi, k2=K2, alpha1=ALPHA1, rate=rate)
        end = solve_ivp(error_rate, (0.0, bound), [-phi / K2], args=(a, b, rate), rtol=1e-9, atol=1e-12)
        assert end.y[0, -1] == pytest.approx(phi / K2, rel=1e-5)


def test_a_quick_incipient_fault_is_an_abrupt_one():
    sizes = {"b_least": 3.0, "a_most": 0.3, "phi": 1.0, "k2": K2, "alpha1": ALPHA1}
    abrupt = theory.detection_bound(**sizes)
    assert theory.detection_bound(**sizes, rate=1e6) == pytest.approx(abrupt, abs=2e-6)
    assert theory.detection_bound(**sizes, rate=K) > abrupt
    assert theory.detection_bound(**sizes, t1=0.1) == pytest.approx(abrupt + 0.1)


def test_where_the_condition_holds_the_residual_is_above_a_threshold_that_moves():
    """A falling threshold: the printed form, with one rho, holds before the residual need be above it."""
    time = np.linspace(0.0, 0.05, 5001)
    rho = np.linspace(0.02, 0.004, 5001)
    a, b = np.full(5001, -0.3), np.full(5001, 3.0)
    worst = residual(time, -0.3, 3.0, begin=-rho[0])
    corrected = theory.detectability(time, a, b, rho, k2=K2, alpha1=ALPHA1)
    printed = theory.detectability(time, a, b, rho, k2=K2, alpha1=ALPHA1, form="printed")
    assert (np.abs(worst) >= rho - 1e-12)[corrected.margin >= 0].all()
    assert corrected.holds_s is not None
    assert (worst[printed.margin >= 0] < rho[printed.margin >= 0]).any()
    never = theory.detectability(time, a, 0.0 * b, rho, k2=K2, alpha1=ALPHA1)
    assert never.holds_s is None


def test_the_error_of_the_smooth_sign():
    xi = np.linspace(-1.0, 1.0, 2_000_001)
    for delta in (0.0612, 0.01):
        largest = np.abs((np.tanh(xi / delta) - np.sign(xi)) * xi).max()
        assert largest <= 0.2785 * delta
        assert largest == pytest.approx(theory.SIGN_ERROR * delta, rel=1e-6)


def test_the_bristle_stays_where_it_is_at_rest_and_within_its_bound_in_motion():
    sigma0, fs, fc, vs = 2.0, 1.5, 1.0, 0.001
    bound = theory.bristle_bound(0.6, fs, sigma0)

    def rate(t, z, speed):
        v = speed(t)
        return v - sigma0 * abs(v) / (fc + (fs - fc) * math.exp(-((v / vs) ** 2))) * z

    rest = solve_ivp(rate, (0.0, 100.0), [0.6], args=(lambda t: 0.0,))
    assert rest.y[0, -1] == 0.6, "input-to-state stability (4.7) would have it decay"
    for speed in (lambda t: 5e-4, lambda t: 0.3 * math.sin(t), lambda t: 0.002 * math.sin(40 * t)):
        moved = solve_ivp(rate, (0.0, 3000.0 if speed(0) else 50.0), [0.6], args=(speed,), rtol=1e-8, max_step=1.0)
        assert np.abs(moved.y).max() <= bound * (1 + 1e-6)
    assert theory.bristle_bound(2.0, fs, sigma0) == 2.0


def test_the_valid_sets_hold_where_theorem_1_does_not():
    """A = 1, Phi = 0.4: the residual settles outside the strip of Theorem 1 and inside the corrected bound."""
    time = np.linspace(0.0, 0.1, 101)
    xi2 = residual(time, 1.0, 0.0, begin=0.02)
    bounds = [theory.velocity_error_bound(t, 0.02, 1.0, K2, ALPHA1) for t in time]
    assert (np.abs(xi2) <= np.array(bounds) + 1e-15).all()
    assert abs(xi2[-1]) > 0.4 / K
    assert not theory.no_false_alarm(1.0, 0.4, K2, ALPHA1)
    assert theory.no_false_alarm(1.0, 1.0, K2, ALPHA1)
    assert theory.position_error_bound(0.0, 0.3, 0.01, 100.0, 5.0) == 0.3
    assert theory.position_error_bound(10.0, 0.3, 0.01, 100.0, 5.0) == pytest.approx(5e-4)


def test_what_cannot_be_is_refused_in_words():
    with pytest.raises(BadInput, match="give the sizes"):
        theory.detection_bound(b_least=-3.0, a_most=0.3, phi=1.0, k2=K2, alpha1=ALPHA1)
    with pytest.raises(BadInput, match="rising times"):
        theory.detectability(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), k2=K2, alpha1=ALPHA1)
