"""The work by pyPESTO with AMICI: the model as SBML, compiled, with CVODES and exact sensitivities.

It needs ``pip install swig amici pypesto petab fides`` besides, and SWIG on the path; AMICI is built where it is
installed. Compiling the model takes a minute of other processes, which the row does not count.
"""

import tempfile
import time

import amici.sim.sundials as amici
import libsbml
import numpy as np
import pypesto
from amici.importers.sbml import SbmlImporter
from amici.importers.sbml.splines import CubicHermiteSpline, UniformGrid
from amici.importers.utils import MeasurementChannel
from pypesto.optimize import FidesOptimizer, minimize

from benchmarks.peers.work import BUDGET_S, NAMES, Work, scored

SMOOTH = 1e-6
"""Rounding of abs(v) [m/s]."""
RATES = {
    "x": "v",
    "z": "dz",
    "v": "(u - K * x - F0 - sigma0 * z - sigma1 * dz - sigma2 * v) / m",
}


def sbml(work: Work) -> libsbml.SBMLDocument:
    """The valve as a model of rates, its force as a spline through all samples."""
    document = libsbml.SBMLDocument(3, 2)
    model = document.createModel("valve")
    free = dict(zip(NAMES, work.guess, strict=True))
    for name, value in {**free, "x": work.y[0], "v": 0.0, "z": 0.0, "dz": 0.0}.items():
        one = model.createParameter()
        one.setId(name)
        one.setConstant(name in free)
        one.setValue(float(value))
    rules = [(model.createRateRule, name, text) for name, text in RATES.items()]
    level = "(fc + (fs - fc) * exp(-(v / vs)^2))"
    rules.append((model.createAssignmentRule, "dz", f"v - sigma0 * sqrt(v^2 + {SMOOTH**2}) / {level} * z"))
    for create, name, text in rules:
        rule = create()
        rule.setVariable(name)
        rule.setMath(libsbml.parseL3Formula(text))
    start = model.createInitialAssignment()
    start.setSymbol("z")
    start.setMath(libsbml.parseL3Formula(f"({work.u[0]} - K * {work.y[0]} - F0) / sigma0"))
    grid = UniformGrid(0, float(work.t[-1] - work.t[0]), number_of_nodes=len(work.t))
    force = work.u + 1e-9 * np.random.default_rng(0).normal(size=len(work.u))  # a flat piece is an error in AMICI
    spline = CubicHermiteSpline("u", grid, force.tolist(), extrapolate=(None, "constant"))
    spline.add_to_sbml_model(model, auto_add="spline")
    return document


def objective(work: Work, folder: str) -> pypesto.AmiciObjective:
    """Residuals in noise units over the logarithms of the parameters."""
    document = sbml(work)
    text = libsbml.writeSBMLToString(document)
    seen = [MeasurementChannel(id_="seen", formula="x", sigma=str(work.noise))]
    model = SbmlImporter(text, from_file=False).sbml2amici("peer_valve", folder, observation_model=seen)
    model.set_timepoints(work.t - work.t[0])
    model.set_parameter_scale(amici.ParameterScaling.log10)
    solver = model.create_solver()
    solver.set_sensitivity_method(amici.SensitivityMethod.forward)
    solver.set_max_steps(2_000_000)
    data = amici.ExpData(model)
    data.set_measurements(work.y)
    return pypesto.AmiciObjective(model, solver, [data])


def solve(work: Work) -> tuple[np.ndarray, str]:
    with tempfile.TemporaryDirectory() as folder:
        found = objective(work, folder)
        names = list(found.x_names)
        guess = np.log10([work.guess[NAMES.index(name)] for name in names])
        problem = pypesto.Problem(found, lb=guess - 2.0, ub=guess + 2.0, x_guesses=[guess])
        started = time.process_time()
        result = minimize(problem, FidesOptimizer(options={"maxtime": BUDGET_S}), n_starts=1, progress_bar=False)
        best = result.optimize_result[0]
        words = f"{best.message or best.exitflag}; {best.n_grad} runs with sensitivities"
        print(f"{time.process_time() - started:.1f} s of it to fit")
        return np.array([10.0 ** best.x[names.index(name)] for name in NAMES]), words


if __name__ == "__main__":
    scored("pyPESTO, AMICI", solve)
