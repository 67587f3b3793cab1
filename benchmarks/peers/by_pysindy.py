"""The work by pysindy alone: the force regressed on position, sliding direction and speed. It has no hidden bristle."""

import numpy as np
import pysindy as ps
from scipy.signal import savgol_filter

from benchmarks.peers.work import RATE_HZ, Work, scored


def solve(work: Work) -> tuple[np.ndarray, str]:
    v = savgol_filter(work.y, 21, 3, deriv=1, delta=1.0 / RATE_HZ)
    sliding = np.abs(v) > 5e-3
    x, speed = work.y[sliding], v[sliding]
    terms = [lambda x, v: np.ones_like(x), lambda x, v: x, lambda x, v: np.sign(v), lambda x, v: v]
    names = [lambda *_: "1", lambda x, _: x, lambda _, v: f"sgn {v}", lambda _, v: v]
    library = ps.CustomLibrary(terms, function_names=names)
    library.fit(np.column_stack([x, speed]))
    table = np.asarray(library.transform(np.column_stack([x, speed])))
    optimizer = ps.STLSQ(threshold=0.0, alpha=0.0)
    optimizer.fit(table / np.abs(table).max(axis=0), work.u[sliding][:, None])
    F0, K, fc, sigma2 = optimizer.coef_.ravel() / np.abs(table).max(axis=0)
    p = np.full(9, np.nan)
    p[[1, 2, 3, 8]] = K, F0, fc, sigma2
    return p, "no guesses; no model that could be simulated"


if __name__ == "__main__":
    scored("pysindy alone", solve)
