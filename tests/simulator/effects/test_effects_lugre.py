"""LuGre friction by itself: energy, steady sliding, and the limits of its friction level."""

from __future__ import annotations

import numpy as np
import pytest
from lugre_reference import Valve

from simulator import CATALOGUE, kernel

T = np.arange(20001) * 1e-4
TYPICAL = {f"lugre.{p.symbol}": p.scale for p in CATALOGUE["lugre"].parameters}


def slide(x, v, values=None, z0=0.0):
    """Friction force along an imposed motion, and the bristle's last deflection."""
    k = kernel(("lugre",), "motion")
    motion = np.column_stack([x, v, 0 * x, 0 * x])
    scan = k.run(T[: len(x)], motion, k.vector(TYPICAL | (values or {})), np.array([z0]))
    assert scan.failed is None
    return scan.outputs[:, 0], scan.final[0]


def motion(seed):
    """A smooth random motion with presliding wiggles and gross sliding: position [m] and velocity [m/s]."""
    rng = np.random.default_rng(seed)
    w = 2 * np.pi * 10 ** rng.uniform(0, 2, (6, 1))
    size, phase = 10 ** rng.uniform(-5, -1.5, (6, 1)) / w, rng.uniform(0, 2 * np.pi, (6, 1))
    return (size * np.sin(w * T + phase)).sum(axis=0), (size * w * np.cos(w * T + phase)).sum(axis=0)


def work(force, x):
    return np.concatenate([[0], np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(x))])


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(("sigma1", "sigma2"), [(0.0, 0.0), (100.0, 50.0), (900.0, 300.0)])
def test_friction_gives_back_at_most_what_the_bristles_store(seed, sigma1, sigma2):
    values = {"lugre.sigma1": sigma1, "lugre.sigma2": sigma2}  # passive: sigma1 (fs - fc) <= sigma2 fc, or no sigma1
    z0 = np.random.default_rng(seed).uniform(-1.5e-4, 1.5e-4)
    x, v = motion(seed)
    force, z = slide(x, v, values, z0)
    stored = 0.5 * TYPICAL["lugre.sigma0"] * z0**2
    assert work(force, x).min() >= -stored * (1 + 1e-3)
    assert work(force, x)[-1] + stored >= 0.5 * TYPICAL["lugre.sigma0"] * z**2


def test_released_bristles_give_back_what_they_store():
    x = -1e-4 * (1 - np.cos(np.pi * T / 2)) / 2
    v = -1e-4 * np.pi / 4 * np.sin(np.pi * T / 2)
    free = {"lugre.sigma1": 0.0, "lugre.sigma2": 0.0, "lugre.fc": 1e4, "lugre.fs": 1e4}
    assert work(slide(x, v, free, z0=1e-4)[0], x).min() == pytest.approx(-0.5e6 * 1e-8, rel=0.02)


@pytest.mark.parametrize("v", [-0.1, -5e-3, -1e-4, 1e-3, 0.02])
def test_steady_sliding_is_the_stribeck_curve(v):
    force, _ = slide(v * T, np.full(len(T), v), {"lugre.sigma0": 1e8})
    valve = Valve()
    assert force[-1] == pytest.approx(np.sign(v) * valve.level(v) + valve.sigma2 * v, rel=1e-9)


def test_presliding_is_the_bristle_stiffness():
    x = 1e-7 * T
    force, _ = slide(x, np.full(len(T), 1e-7), {"lugre.sigma1": 0.0, "lugre.sigma2": 0.0})
    assert force[-1] == pytest.approx(TYPICAL["lugre.sigma0"] * x[-1], rel=2e-3)


def test_no_friction_level_means_no_friction():
    x, v = motion(0)
    gone = {"lugre.fc": 0.0, "lugre.fs": 0.0, "lugre.sigma1": 0.0}
    assert slide(x, v, gone)[0] == pytest.approx(300.0 * v, abs=1e-3)
