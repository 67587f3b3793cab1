"""Exported models against our own simulation: C source compiled and run, a CasADi function, a mock-up unit."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from effect_contract import FORCE, Subject, T

from recordings import BadInput
from simulator import BASE, CATALOGUE, FINE_STEP, Value, ValveModel, kernel
from simulator.delay import delay_columns
from simulator.export import ExportedStep, c_source, casadi_step, write_c, write_casadi, write_fmu

START = 0.005
NEAR = 1e-9
"""How far apart they may be, relative to the travel."""
DT = T[1] - T[0]
MANY = (
    "dwell_stiction", "nonlocal_presliding", "periodic_force", "actuator_hysteresis", "dead_time", "backlash",
    "sensor_lag",
)  # fmt: skip
CALLER = """
#include "{name}.h"
long run(long n, const double *u, double dt, double start, double *y) {{
  static valve_state s;
  valve_inputs in;
  valve_init(&s, 0, start, 0, u[0]);
  y[0] = valve_position(&s);
  for (long k = 1; k < n; ++k) {{
    in.force = u[k - {back}];
    if (valve_step(&s, &in, dt)) return k;
    y[k] = valve_position(&s);
  }}
  in.force = 0;
  return valve_step(&s, &in, 0.0) == VALVE_BAD_STEP ? 0 : -1;
}}
"""
compiled = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


def model_of(*added: str) -> ValveModel:
    """The base effects and some more, all at their typical values."""
    ids = (*BASE, *added)
    values = {name: value for one in ids for name, value in Subject(CATALOGUE[one], CATALOGUE).typical.items()}
    declared = CATALOGUE.parameters(ids)
    return ValveModel(effects=ids, parameters={n: Value(value=values[n], unit=p.unit) for n, p in declared.items()})


def simulated(model: ValveModel, *, hold: bool, h_max: float = FINE_STEP) -> np.ndarray:
    """The measured position [m] by our own simulation."""
    valve = kernel(model.effects)
    start = valve.start(START, force=FORCE[0])
    return valve.run(T, FORCE, valve.vector(model.values), start, h_max=h_max, hold=hold).outputs[:, 0]


def apart(found: np.ndarray, expected: np.ndarray) -> float:
    """The largest difference, relative to the travel."""
    assert np.isfinite(found).all()
    return float(np.abs(found - expected).max() / np.ptp(expected))


def run_c(model: ValveModel, folder: Path, *, hold: bool) -> np.ndarray:
    """The measured position [m] by the exported C source, compiled without a warning."""
    source, header = write_c(ExportedStep(model), folder / "valve.c", hold=hold)
    caller, library = folder / "caller.c", folder / "library.so"
    caller.write_text(CALLER.format(name=header.stem, back=int(hold)))
    warnings = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror")
    command = ["gcc", "-O2", *warnings, "-fPIC", "-shared", "-o", library, source, caller, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    positions, vector = np.zeros(len(T)), ctypes.c_void_p
    run = ctypes.CDLL(str(library)).run
    run.restype, run.argtypes = ctypes.c_long, (ctypes.c_long, vector, ctypes.c_double, ctypes.c_double, vector)
    assert run(len(T), FORCE.ctypes.data, DT, START, positions.ctypes.data) == 0
    return positions


@compiled
@pytest.mark.parametrize("hold", [False, True])
def test_the_c_source_moves_as_the_simulation_does(tmp_path, hold):
    model = model_of(*MANY)
    assert apart(run_c(model, tmp_path, hold=hold), simulated(model, hold=hold)) < NEAR


@compiled
@pytest.mark.slow
@pytest.mark.parametrize("effect", CATALOGUE.ids[len(BASE) :])
def test_the_c_source_of_every_effect(tmp_path, effect):
    model = model_of(effect)
    assert apart(run_c(model, tmp_path, hold=False), simulated(model, hold=False)) < NEAR


def test_the_header_names_every_parameter_with_its_unit_and_what_is_known_of_it():
    model = model_of("backlash")
    weak = Value(value=2.0, std=0.9, unit="kg", status="weak")
    model = model.model_copy(update={"parameters": model.parameters | {"mass.m": weak}})
    made = c_source(ExportedStep(model), "tv 101")
    assert "double mass_m; /* kg: moving mass" in made.header
    assert "(weak, standard deviation 0.9)" in made.header
    assert "int tv_101_step(tv_101_state *s, const tv_101_inputs *in, double dt);" in made.header
    includes = [line for line in made.source.splitlines() if line.startswith("#include")]
    assert includes == ['#include "tv_101.h"', "#include <math.h>"]


def run_casadi(function: ca.Function, model: ValveModel) -> np.ndarray:
    """The measured position [m] by the exported function, over all samples at once."""
    n, valve = len(T) - 1, kernel(model.effects)
    row = {"force": FORCE[:-1], "force_end": FORCE[1:], "time": T[:-1], "dt": np.full(n, DT)}
    if "dead_time" in model.effects:
        a, b = delay_columns(T, FORCE, model.values["dead_time.tau"], False).T
        late = a - b * model.values["dead_time.tau"]
        row |= {"late": late[:-1], "late_end": late[1:]}
    given = {name: ca.DM(values).T for name, values in row.items()}
    found = function.mapaccum(n)(state=valve.start(START, force=FORCE[0]), change=0, **given)
    return np.array(found["position"]).ravel()


@pytest.mark.parametrize("added", [("sensor_lag",), MANY])
def test_the_casadi_function_moves_as_the_simulation_does(tmp_path, added):
    model = model_of(*added)
    path = write_casadi(ExportedStep(model), tmp_path / "valve.casadi", sub_steps=4)
    function = ca.Function.load(str(path))
    expected = simulated(model, hold=False, h_max=DT / 4)
    assert apart(run_casadi(function, model), expected[1:]) < NEAR


def test_the_casadi_function_has_the_derivatives_of_the_motion():
    model = model_of()
    step = ExportedStep(model)
    function = casadi_step(step)
    change = ca.MX.sym("change", len(step.parameters))
    state = [0.004, 0.01, 1e-5]
    end = function(state=state, force=600, force_end=610, dt=1e-3, time=0, change=change)["state_end"]
    by_change = ca.Function("by_change", [change], [end, ca.jacobian(end, change)])
    place = [one.full_name for one in step.parameters].index("spring.K")
    small = np.zeros(len(step.parameters))
    small[place] = 1e-3 * model.values["spring.K"]
    _, slope = by_change(0 * small)
    numeric = (by_change(small)[0] - by_change(-small)[0]) / (2 * small[place])
    assert np.allclose(np.array(slope)[:, place], np.array(numeric).ravel(), rtol=1e-4)


@compiled
@pytest.mark.parametrize("added", [("backlash",), ("dead_time",)])
def test_the_mock_up_unit_is_valid_and_moves_as_the_simulation_does(tmp_path, added):
    fmpy = pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    model = model_of(*added)
    path = str(write_fmu(ExportedStep(model), tmp_path / "valve.fmu"))
    assert validate_fmu(path) == []
    stiff = model.values["spring.K"] * 1.1
    for parameters in ({}, {"spring.K": stiff}):
        changed = model.parameters | {name: Value(value=value, unit="N/m") for name, value in parameters.items()}
        expected = simulated(model.model_copy(update={"parameters": changed}), hold=True)
        given = np.array(list(zip(T, FORCE, strict=True)), dtype=[("time", float), ("force", float)])
        found = fmpy.simulate_fmu(
            path, stop_time=T[-1], output_interval=DT, input=given, output=["position"],
            start_values={"initial.position": START, "force": FORCE[0], **parameters},
        )  # fmt: skip
        assert np.allclose(found["time"], T, atol=1e-12)
        assert apart(found["position"], expected) < NEAR


def test_without_a_compiler_the_unit_says_so(tmp_path, monkeypatch):
    pytest.importorskip("fmpy")
    monkeypatch.setenv("BRISTLE_NO_COMPILER", "1")
    with pytest.raises(BadInput, match="no C compiler"):
        write_fmu(ExportedStep(model_of()), tmp_path / "valve.fmu")
    assert list(tmp_path.iterdir()) == []
