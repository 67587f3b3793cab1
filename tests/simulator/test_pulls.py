"""What measurements pull at: the places of effects that no regression shows."""

from __future__ import annotations

import numpy as np
import pytest

from simulator import FirstLook, most_pulled, random_valve

VALVE, STROKE = random_valve(3)
T = np.arange(0.0, 60.0, 4e-3)
X = 0.5 * STROKE * (1 - np.cos(2 * np.pi * T / 15.0))
PLACES = np.linspace(0.05, 0.95, 19) * STROKE


def hump(x0: float):
    return {"x0": x0}, {"f": lambda r: np.exp(-(((r.x - x0) / (0.08 * STROKE)) ** 2))}


def look(strength: float, x0: float, noise: np.ndarray | float = 1.0, *, fitted: bool = True) -> FirstLook:
    """A look at a valve that moves evenly, whose pulls have a scatter [1/N] and ask for a hump of so many of them."""
    rng = np.random.default_rng(5)
    motion = np.column_stack([X, np.gradient(X, T), np.gradient(X, T)])
    drawn = rng.standard_normal((len(T), 5)) * np.broadcast_to(noise, T.shape)[:, None]
    u = VALVE["spring.K"] * X + VALVE["spring.F0"]
    seen = FirstLook.of(T, motion, u, VALVE)
    [shape] = hump(x0)[1].values()
    drawn[:, 0] += strength * shape(seen)
    return FirstLook.of(T, motion, u, VALVE, pulls=drawn) if fitted else seen


def places(seen: FirstLook) -> list[float]:
    return [values["x0"] for values, _ in most_pulled([seen], VALVE, map(hump, PLACES))]


@pytest.mark.parametrize("share", [0.25, 0.6, 0.8])
def test_the_place_that_measurements_pull_at_is_found_in_pulls_that_are_mostly_noise(share: float):
    assert places(look(0.3, share * STROKE))[0] == pytest.approx(share * STROKE, abs=0.051 * STROKE)


def test_large_pulls_are_no_strong_ones_where_noise_pulls_as_much():
    rough = np.where(X < 0.3 * STROKE, 30.0, 1.0)
    assert places(look(0.5, 0.7 * STROKE, rough))[0] == pytest.approx(0.7 * STROKE, abs=0.051 * STROKE)


def test_further_places_say_something_else():
    first, *others = places(look(1.0, 0.5 * STROKE))
    assert len(others) == 2
    assert all(abs(other - first) > 0.06 * STROKE for other in others)


def test_without_a_fit_nothing_pulls():
    assert places(look(1.0, 0.5 * STROKE, fitted=False)) == []
