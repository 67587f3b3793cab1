"""The damped step: second order, L-stable, right where it resolves the slip, the same with and without a compiler."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import Array
from simulator import BASE, Kernel, kernel

STIFF = {
    "mass.m": 2.0, "spring.K": 60900.0, "spring.F0": 580.0, "lugre.fc": 150.0, "lugre.fs": 200.0, "lugre.vs": 5e-3,
    "lugre.sigma0": 1e7, "lugre.sigma1": 3000.0, "lugre.sigma2": 500.0,
}  # fmt: skip
SOFT = STIFF | {"lugre.sigma0": 1e5, "lugre.sigma1": 300.0, "lugre.vs": 5e-2}


def _stroke(model: Kernel, values: dict[str, float], h: float) -> Array:
    """The position after each of 40 samples of 20 ms of a force that pushes a valve out and lets it back."""
    t = np.arange(41) * 0.02
    force = 580.0 + 600.0 * np.sin(2 * np.pi * t / 0.8)
    return model.run(t, force, model.vector(values), model.start(), h_max=h).outputs[:, 0]


def test_halving_the_sub_step_divides_the_error_by_four():
    model = kernel(BASE, damped=True)
    exact = _stroke(kernel(BASE), SOFT, 1e-6)
    errors = [float(np.max(np.abs(_stroke(model, SOFT, h) - exact))) for h in (2e-4, 1e-4, 5e-5)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.35)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.35)


def test_the_bristle_s_swing_is_damped_where_it_is_not_resolved():
    t = np.arange(200) * 2.5e-3
    values = STIFF | {"lugre.sigma1": 0.0, "lugre.sigma2": 0.0}
    force = np.full(len(t), 580.0)
    force[1:] += 50.0  # a jump below break-away: the mass swings on its bristles by 5.6 rad in a sub-step
    rest = 50.0 / (values["lugre.sigma0"] + values["spring.K"])
    swings = {}
    for damped in (False, True):
        model = kernel(BASE, damped=damped)
        x = model.run(t, force, model.vector(values), model.start(), h_max=2.5e-3).outputs[:, 0]
        swings[damped] = float(np.ptp(x[20:60]))
    assert swings[True] < 1e-3 * rest
    assert swings[False] > 0.3 * rest


def test_a_stiff_valve_in_steps_that_resolve_its_slip_is_where_fine_steps_take_it():
    coarse = _stroke(kernel(BASE, damped=True), STIFF, 1.25e-3)
    fine = _stroke(kernel(BASE), STIFF, 1e-5)
    assert float(np.sqrt(np.mean((coarse - fine) ** 2))) < 0.01 * float(np.std(fine))


@pytest.mark.parametrize("causality", ["force", "force with error"])
def test_derivatives_are_those_of_differences(causality: str):
    model = kernel(BASE, causality, damped=True)
    t = np.arange(60) * 0.01
    force = 580.0 + 600.0 * np.sin(2 * np.pi * t / 0.6)
    p, s0 = model.vector(SOFT), np.zeros(len(model.states))
    inputs = force if causality == "force" else np.empty((len(t), 0))
    s0[-2:] = s0[-2:] if causality == "force" else (700.0, 500.0)
    run = model.run(t, inputs, p, s0, h_max=2e-3, sensitivities=True)
    assert run.jacobian is not None
    for i in range(len(p)):
        step = 1e-5 * p[i]
        sides = [
            model.run(t, inputs, p + sign * step * np.eye(len(p))[i], s0, h_max=2e-3).outputs[:, 0] for sign in (1, -1)
        ]
        by = (sides[0] - sides[1]) / (2 * step)
        assert run.jacobian[:, 0, i] == pytest.approx(by, rel=1e-4, abs=1e-5 * float(np.max(np.abs(by))) + 1e-14)


def test_without_a_c_compiler_the_numbers_are_the_same(monkeypatch: pytest.MonkeyPatch):
    compiled = _stroke(kernel(BASE, damped=True), STIFF, 2e-3)
    monkeypatch.setenv("BRISTLE_NO_COMPILER", "1")
    portable = kernel(BASE, damped=True)
    assert not portable.scanner.compiled
    assert _stroke(portable, STIFF, 2e-3) == pytest.approx(compiled, rel=1e-9, abs=1e-12)
