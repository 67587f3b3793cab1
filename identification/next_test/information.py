"""What a test would teach: intervals of parameters, and how far rivals would be apart.

Both rest on the sensitivities of the compiled physics, at the values that are known now and with what is known of them
as a prior. D-optimal for parameters, T-optimal between rivals: Atkinson, Donev and Tobias, Optimum Experimental
Designs, with SAS (2007), chapters 10 and 20.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from identification.next_test.knowledge import DrivenTest, ExpectedPath, KnownValve
from recordings import Array

ROUNDS = 8
"""Runs of a rival while it is fitted to the other's answer."""
CLIPPED = 5.0
"""What a single sample says at most, in noise sigmas; the scale of the loss of a fit."""


def answered(valve: KnownValve, test: DrivenTest) -> ExpectedPath | None:
    """What a model expects of a test that begins at rest; None where it diverges."""
    return valve.response(test, valve.p, valve.at_rest(float(test.force[0])))


def expected_std(valve: KnownValve, path: ExpectedPath) -> Array:
    """Standard deviations (n_free,) of the parameters after a test, SI units."""
    spread = np.sqrt(np.diag(_covariance(valve, path)))[: len(valve.names)]
    return np.asarray(spread * np.abs(valve.coordinates.slope(valve.p)), float)


def gained(valve: KnownValve, path: ExpectedPath, names: tuple[str, ...]) -> float:
    """Minus the logarithm of the determinant of the covariance of some parameters after a test: D-optimal for them."""
    chosen = [valve.names.index(name) for name in names]
    return -float(np.linalg.slogdet(_covariance(valve, path)[np.ix_(chosen, chosen)])[1])


def apart(one: ExpectedPath, rival: KnownValve, path: ExpectedPath) -> float:
    """Distance of two answers [noise sigmas] that is left when the rival's parameters follow, to first order.

    one : the answer of a model; path : that of its rival. A sample counts at most `CLIPPED`: a test that differs all
    along is better than one with a single slip that comes early.
    """
    noise: Array = np.maximum(one.noise, path.noise)
    r: Array = np.clip((one.y - path.y) / noise, -CLIPPED, CLIPPED)
    towards = (path.by / noise[:, None]).T @ r
    explained = towards @ _covariance(rival, path) @ towards
    return float(np.sqrt(max(float(r @ r) - float(explained), 0.0)))


def fitted_apart(one: ExpectedPath, rival: KnownValve, test: DrivenTest) -> float:
    """Distance of a rival from the answer of a model [noise sigmas] when the rival is fitted to it."""
    n, start = len(rival.names), rival.at_rest(float(test.force[0]))
    spread = np.concatenate([rival.std, rival.start_std])
    bounds = rival.coordinates.bounds

    def weighted(unknowns: Array) -> tuple[Array, Array]:
        theta = np.clip(rival.theta + unknowns[:n] * spread[:n], bounds.lower, bounds.upper)
        s0 = start.copy()
        s0[rival.own_starts] += unknowns[n:] * spread[n:]
        found = rival.response(test, rival.coordinates.p(theta), s0)
        if found is None:
            return np.full(len(one.y) + len(unknowns), 1e6), np.zeros((len(one.y) + len(unknowns), len(unknowns)))
        residual = np.concatenate([(found.y - one.y) / one.noise, unknowns])
        return residual, np.vstack([found.by * spread / one.noise[:, None], np.eye(len(unknowns))])

    at = _remembered(weighted)
    end = least_squares(
        lambda x: at(x)[0], np.zeros(len(spread)), lambda x: at(x)[1], max_nfev=ROUNDS, loss="cauchy", f_scale=CLIPPED
    )
    return float(np.sqrt(2 * end.cost))


def _remembered(work: Callable[[Array], tuple[Array, Array]]) -> Callable[[Array], tuple[Array, Array]]:
    """The same function, which is not asked again where it was asked last."""
    last: dict[bytes, tuple[Array, Array]] = {}

    def at(unknowns: Array) -> tuple[Array, Array]:
        key = unknowns.tobytes()
        if key not in last:
            last.clear()
            last[key] = work(unknowns)
        return last[key]

    return at


def _covariance(valve: KnownValve, path: ExpectedPath) -> Array:
    """Covariance (n_free + n_starts)^2 of the coordinates and the start after a test."""
    spread = np.concatenate([valve.std, valve.start_std])
    scaled = path.by / path.noise[:, None] * spread
    inner = np.linalg.inv(scaled.T @ scaled + np.eye(len(spread)))
    return np.asarray(inner * np.outer(spread, spread), float)
