"""What is known of LuGre friction before any measurement, as weak normal priors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimators.least_squares import Normal
from recordings import Array


@dataclass(frozen=True)
class Prior:
    """A weak normal prior on a sum of coordinates: weights by parameter name, mean and standard deviation."""

    weights: Mapping[str, float]
    mean: float
    std: float


PRIORS = (
    Prior({"lugre.fs": 1, "lugre.fc": -1}, float(np.log(1.3)), 0.4),
    Prior({"lugre.vs": 1}, float(np.log(4e-3)), 1.0),
    Prior({"mass.m": 1}, float(np.log(3.0)), 1.5),
    Prior({"lugre.sigma1": 2, "lugre.sigma0": -1, "mass.m": -1}, float(np.log(0.36)), 1.5),
)
"""What is known of LuGre friction before any measurement: it matters only where a recording says nothing."""


UNRESOLVED = (*PRIORS[:-1], Prior(PRIORS[-1].weights, PRIORS[-1].mean, 0.4))
"""The same where the sampling does not tell the bristle's damping: left free, it trades with viscous friction."""


def prior(names: Sequence[str], theta: Array, known: Sequence[Prior] = PRIORS) -> Normal:
    """Normal equations of some priors, those on coordinates that are free."""
    normal = Normal(0.0, np.zeros(len(theta)), np.zeros((len(theta), len(theta))))
    for one in known:
        if not set(one.weights) <= set(names):
            continue
        a = np.array([one.weights.get(name, 0.0) for name in names])
        off = float(a @ theta) - one.mean
        normal = Normal(
            normal.cost + (off / one.std) ** 2,
            normal.gradient + off / one.std**2 * a,
            normal.matrix + np.outer(a, a) / one.std**2,
        )
    return normal
