"""The work by scipy: least squares around an adaptive integrator."""

import numpy as np
from scipy.optimize import least_squares

from benchmarks.peers.work import OutOfTime, Residual, Work, scored


def solve(work: Work) -> tuple[np.ndarray, str]:
    residual = Residual(work)
    try:
        found = least_squares(residual, np.ones(9), bounds=(1e-2, 1e2), diff_step=1e-4, x_scale="jac", loss="soft_l1")
        return residual.answer(f"ended ({found.message.split('.')[0]})")
    except OutOfTime:
        return residual.answer("out of time")


if __name__ == "__main__":
    scored("scipy least_squares, LSODA", solve)
