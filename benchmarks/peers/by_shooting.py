"""The work by hand in CasADi: direct multiple shooting of the free run, solved by IPOPT."""

import casadi as ca
import numpy as np

from benchmarks.peers.work import BUDGET_S, RATE_HZ, Work, scored

SUB_STEPS, SMOOTH, SAMPLES = 20, 1e-6, 10
"""Runge-Kutta steps between samples; rounding of abs(v) [m/s]; samples in a shooting interval."""
SCALE = np.array([1e-2, 1e-1, 1e-5])


def solve(work: Work) -> tuple[np.ndarray, str]:
    q, s, force, h = ca.SX.sym("q", 9), ca.SX.sym("s", 3), ca.SX.sym("u", 2), 1.0 / RATE_HZ / SUB_STEPS
    m, K, F0, fc, fs, vs, s0, s1, s2 = ca.vertsplit(q * work.guess)

    def rates(state: ca.SX, u: ca.SX) -> ca.SX:
        x, v, z = ca.vertsplit(state * SCALE)
        dz = v - s0 * ca.sqrt(v**2 + SMOOTH**2) / (fc + (fs - fc) * ca.exp(-((v / vs) ** 2))) * z
        return ca.vertcat(v, (u - K * x - F0 - s0 * z - s1 * dz - s2 * v) / m, dz) / SCALE

    y = s
    for i in range(SUB_STEPS):
        u = [force[0] + (force[1] - force[0]) * (i + part) / SUB_STEPS for part in (0.0, 0.5, 1.0)]
        k1 = rates(y, u[0])
        k2 = rates(y + h / 2 * k1, u[1])
        k3 = rates(y + h / 2 * k2, u[1])
        y += h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(y + h * k3, u[2]))
    step = ca.Function("step", [s, q, force], [y]).mapaccum("interval", SAMPLES)
    n = (len(work.t) - 1) // SAMPLES
    forces = np.array([work.u[:-1], work.u[1:]])[:, : n * SAMPLES]
    nodes, factors = ca.MX.sym("nodes", 3, n), ca.MX.sym("q", 9)
    run = step.map(n)(nodes, ca.repmat(factors, 1, n * SAMPLES), forces) if n else nodes
    ends = run[:, SAMPLES - 1 :: SAMPLES]
    error = (run[0, :] * SCALE[0] - work.y[None, 1 : n * SAMPLES + 1]) / work.noise
    problem = {"x": ca.vertcat(factors, ca.vec(nodes)), "f": ca.sumsqr(error), "g": ca.vec(ends[:, :-1] - nodes[:, 1:])}
    options = {"print_level": 0, "max_cpu_time": BUDGET_S, "hessian_approximation": "limited-memory"}
    solver = ca.nlpsol("shooting", "ipopt", problem, {"print_time": False, "ipopt": options})
    at = np.arange(n) * SAMPLES
    start = np.vstack([work.y[at], np.gradient(work.y, work.t)[at], np.zeros(n)]) / SCALE[:, None]
    low = np.concatenate([np.full(9, 1e-2), np.full(3 * n, -np.inf)])
    found = solver(x0=np.concatenate([np.ones(9), start.ravel("F")]), lbx=low, lbg=0.0, ubg=0.0)
    left = np.sqrt(float(found["f"]) / (n * SAMPLES))
    said = solver.stats()["return_status"]
    return np.asarray(found["x"]).ravel()[:9] * work.guess, f"{said}, residual {left:.3g} times the noise"


if __name__ == "__main__":
    scored("multiple shooting in CasADi, IPOPT", solve)
