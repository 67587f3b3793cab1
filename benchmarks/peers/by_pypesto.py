"""The work by pyPESTO: three starts of scipy's least squares around an adaptive integrator, without AMICI."""

import numpy as np
import pypesto
import pypesto.optimize

from benchmarks.peers.work import BUDGET_S, NAMES, OutOfTime, Residual, Work, scored

STARTS = 3


def solve(work: Work) -> tuple[np.ndarray, str]:
    residual = Residual(work)

    def jacobian(log_q: np.ndarray) -> np.ndarray:
        q, base = 10.0**log_q, residual(10.0**log_q)
        columns = [(residual(10.0 ** (log_q + 1e-4 * one)) - base) / 1e-4 for one in np.eye(len(q))]
        return np.column_stack(columns)

    objective = pypesto.Objective(res=lambda log_q: residual(10.0**log_q), sres=jacobian)
    problem = pypesto.Problem(
        objective, lb=-1.0, ub=1.0, dim_full=len(NAMES), x_names=list(NAMES), x_guesses=np.zeros((1, len(NAMES)))
    )
    options = pypesto.optimize.OptimizeOptions(allow_failed_starts=False)
    try:
        pypesto.optimize.minimize(
            problem, pypesto.optimize.ScipyOptimizer("ls_trf"), n_starts=STARTS, options=options, progress_bar=False
        )
        return residual.answer(f"{STARTS} starts ended")
    except OutOfTime:
        return residual.answer(f"out of time ({BUDGET_S:.0f} s)")


if __name__ == "__main__":
    scored("pyPESTO, ls_trf, LSODA", solve)
