"""Tao and Kokotovic's eight parameters from measured input and output (equation 2.44)."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from recordings import Array, BadInput, BadParameter
from simulator.hysteresis.quadrilateral import Lines, moved_to


class QuadrilateralFit(NamedTuple):
    """The lines, and the RMS error of the output when it is run from the first measured value."""

    lines: Lines
    rmse: float


def fit_quadrilateral(input: ArrayLike, output: ArrayLike, **lines: float) -> QuadrilateralFit:
    """The hysteresis (2.44) whose output is nearest to a measured one, by least squares of the whole run.

    input, output (n_samples), the first on the loop; lines : a first guess mt, ct, mb, cb, mr, cr, ml, cl, whose lines
    the path is to reach: what it does not reach it does not tell. The logarithms of the gaps between the slopes are
    fitted, so that the lines keep their order.
    Raises BadParameter for rows that differ or are too short, and for a guess as `Quadrilateral`; BadInput where the
    lines that come out have crossed: the path does not tell them.
    """
    v, u = np.asarray(input, dtype=float), np.asarray(output, dtype=float)
    if v.shape != u.shape or v.ndim != 1 or len(v) < 16 or not (np.isfinite(v).all() and np.isfinite(u).all()):
        raise BadParameter("output", u.shape, f"beside inputs {v.shape}", "give equal finite rows, sixteen or more")
    first = _coordinates(Lines(**lines).enclosing())

    def run(p: Array) -> Array:
        k, out = Lines(**_lines(p)), [float(u[0])]
        for before, value in pairwise(v.tolist()):
            out.append(moved_to(k, before, value, out[-1]))
        return np.array(out)

    size = max(float(np.std(u)), 1e-300)
    found = least_squares(lambda p: (run(p) - u) / size, first, diff_step=1e-5)
    error = float(np.sqrt(np.mean((run(found.x) - u) ** 2)))
    try:
        return QuadrilateralFit(Lines(**_lines(found.x)).enclosing(), error)
    except BadParameter as crossed:
        remedy = "give a path that reaches all four lines, and a nearer guess"
        raise BadInput("output", f"what was fitted has crossed lines: {crossed}", remedy) from None


def _coordinates(k: Lines) -> Array:
    flat = max(k.mt, k.mb)
    slopes = [np.log(k.mt), np.log(k.mb), np.log(k.mr - flat), np.log(k.ml - flat)]
    return np.array([*slopes, k.ct, k.cb, k.cr, k.cl])


def _lines(p: Array) -> dict[str, float]:
    """The eight parameters by name."""
    mt, mb = float(np.exp(p[0])), float(np.exp(p[1]))
    flat = max(mt, mb)
    mr, ml = flat + float(np.exp(p[2])), flat + float(np.exp(p[3]))
    ct, cb, cr, cl = (float(x) for x in p[4:])
    return {"mt": mt, "ct": ct, "mb": mb, "cb": cb, "mr": mr, "cr": cr, "ml": ml, "cl": cl}
