"""Usual values for what noise and missing effects make extreme in a fit."""

from __future__ import annotations

import numpy as np

from identification.estimators.coordinates import Coordinates
from recordings import Array

RISING = 0.8
"""Slope at which a rising friction curve goes from fs to fc, in (fc - fs)/vs."""


def usual_values(coordinates: Coordinates, theta: Array) -> list[Array]:
    """A start with what noise makes extreme set to usual values: friction curve, damping of the bristle, and mass. A
    curve that rises with speed, fs below fc, is viscous friction in disguise.

    theta (m,) : the start, in the given coordinates, as the answers.
    """
    value = coordinates.values(theta)
    rise = value["lugre.fc"] - value["lugre.fs"]
    if rise > 0:
        viscous = value["lugre.sigma2"] + RISING * rise / value["lugre.vs"]
        value = value | {"lugre.fc": value["lugre.fs"], "lugre.sigma2": viscous}
    fc, critical = value["lugre.fc"], 2 * np.sqrt(value["lugre.sigma0"])
    curve = {"lugre.fs": float(np.clip(value["lugre.fs"], 1.1 * fc, 1.5 * fc)),
             "lugre.vs": float(np.clip(value["lugre.vs"], 1.5e-3, 1e-2))}  # fmt: skip
    masses = dict.fromkeys((3.0, value["mass.m"]))
    return [
        coordinates.theta_of(value | curve | {"mass.m": m, "lugre.sigma1": 0.3 * critical * np.sqrt(m)}) for m in masses
    ]
