"""Runs of several segments at once: the numbers of runs one after the other, whatever their lengths and resets."""

from __future__ import annotations

import numpy as np
import pytest
from lugre_reference import Valve, slow_force

from simulator import BASE, Run, kernel

LENGTHS = (401, 120, 2, 333, 1, 250, 400, 77, 310, 18)
"""Samples of segments: more of them than fit into a vector, one after the other the longest."""
FREE = (1, 3, 4, 6)
"""The parameters that derivatives are taken by."""


def segments(valve, rng, hold=False):
    found = []
    for n in LENGTHS:
        t = np.cumsum(rng.uniform(1.5e-3, 2.5e-3, n)) + rng.uniform(0, 5)
        u = slow_force(t) + rng.normal(0.0, 1.0, n)
        resets = np.full((n, len(valve.states)), np.nan)
        resets[::60, 0], resets[::60, 1] = rng.normal(0.012, 1e-4, len(resets[::60])), 0.0
        resets[::120, 2] = 1e-5
        found.append(Run(t, u, valve.start(0.012, 0.01, u[0]), hold, resets if n % 2 else None))
    return found


@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("hold", [False, True])
def test_runs_together_are_what_they_are_alone(way, damped, hold):
    valve = kernel(BASE, damped=damped)
    p = valve.vector(Valve.stiff(1e6).values())
    runs = segments(valve, np.random.default_rng(3), hold)
    together = valve.run_together(runs, p, FREE, h_max=5e-4)
    columns = [*FREE, *range(len(p), len(p) + len(valve.states))]
    for (outputs, jacobian), given in zip(together, runs, strict=True):
        t, u, s0, held, resets = given
        alone = valve.run(t, u, p, s0, h_max=5e-4, hold=held, sensitivities=True, resets=resets)
        np.testing.assert_allclose(outputs, alone.outputs, rtol=1e-10, atol=1e-14)
        size = np.abs(alone.jacobian[:, :, columns]).max() + 1e-300
        np.testing.assert_allclose(jacobian, alone.jacobian[:, :, columns], rtol=1e-6, atol=1e-8 * size)


def test_where_one_fails_there_is_no_answer(way):
    valve = kernel(BASE)
    p = valve.vector(Valve.stiff(1e6).values())
    runs = segments(valve, np.random.default_rng(4))
    broken = runs[3].u.copy()
    broken[200] = np.inf
    assert valve.run_together([*runs[:3], runs[3]._replace(u=broken)], p, FREE, h_max=5e-4) is None
    assert valve.run_together(runs[:3], p, FREE, h_max=5e-4) is not None


def test_times_that_do_not_rise_are_refused(way):
    valve = kernel(BASE)
    runs = segments(valve, np.random.default_rng(5))
    back = runs[1].t.copy()
    back[5] = back[4]
    with pytest.raises(ValueError, match="rise"):
        valve.run_together([runs[0], runs[1]._replace(t=back)], valve.vector(Valve.stiff(1e6).values()), FREE)
