"""The work by lmfit: named parameters with bounds, Levenberg-Marquardt."""

import lmfit
import numpy as np

from benchmarks.peers.work import NAMES, OutOfTime, Residual, Work, scored


def solve(work: Work) -> tuple[np.ndarray, str]:
    residual, parameters = Residual(work), lmfit.Parameters()
    for name in NAMES:
        parameters.add(name, value=1.0, min=1e-2, max=1e2)
    try:
        found = lmfit.minimize(lambda q: residual(np.array([q[n].value for n in NAMES])), parameters, epsfcn=1e-8)
        return residual.answer(f"ended ({found.message.split('.')[0]}), standard errors: {found.errorbars}")
    except OutOfTime:
        return residual.answer("out of time")


if __name__ == "__main__":
    scored("lmfit leastsq, LSODA", solve)
