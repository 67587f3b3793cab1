"""Friction models fitted to a recorded force: each finds itself again, and the comparison prefers the true one."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import lsq_linear

import bristle as br
from identification import FRICTION_MODELS
from identification.friction.fit import _least_squares
from identification.friction.models import ImposedPath
from recordings import BadInput, BadParameter, Recording
from simulator.backlash import SmoothBacklash
from simulator.friction import LuGreParameters
from simulator.hysteresis import MaxwellSlip

DT, N = 0.01, 3000
T = DT * np.arange(N)
X = 4e-4 * np.sin(2 * np.pi * T / 5) + 2e-4 * np.sin(2 * np.pi * T / 1.7)
"""A motion with inner loops [m]."""


def rig(force):
    rng = np.random.default_rng(1)
    return Recording.from_arrays(
        time=T, position=X + 1e-8 * rng.normal(size=N), force=force + 0.05 * rng.normal(size=N),
        roles={"position": "input", "force": "output"},
    )  # fmt: skip


def maxwell():
    return MaxwellSlip([1e5, 10 / 1.5e-4, 8 / 3e-4], [5.0, 10.0, 8.0], X[0]).follow(X) + 3e4 * X + 20.0


def lugre():
    return LuGreParameters(2e5, 0.0, 500.0, 15.0, 22.0, 3e-4).follow(T, X) + 3e4 * X + 20.0


def test_lugre_along_a_motion_is_its_differential_equation():
    model = LuGreParameters(2e5, 300.0, 500.0, 15.0, 22.0, 3e-4)
    t, x = T[:100], X[:100]
    pace = np.diff(x) / np.diff(t)

    def rate(now, z):
        v = pace[min(int(now / DT + 1e-9), len(pace) - 1)]
        return v - abs(v) * model.sigma0 * z / model.level(v)

    z = [0.0]
    for k in range(len(pace)):  # the velocity jumps at the samples, so each interval is integrated by itself
        z.append(solve_ivp(rate, (t[k] + 1e-12, t[k + 1] - 1e-12), [z[-1]], rtol=1e-10, atol=1e-16).y[0, -1])
    mean = np.diff(z) / DT
    expected = model.sigma0 * np.array(z[1:]) + model.sigma1 * mean + model.sigma2 * pace
    assert model.follow(t, x)[1:] == pytest.approx(expected, rel=1e-5, abs=1e-5)


def test_maxwell_slip_along_a_path_is_its_updates_one_by_one():
    one, other = (MaxwellSlip([1e5, 5e4], [5.0, 10.0], X[0]) for _ in range(2))
    assert one.follow(X[:200]) == pytest.approx([other.update(x) for x in X[:200]], abs=1e-12)


@pytest.mark.parametrize("name", sorted(FRICTION_MODELS))
def test_every_model_has_a_column_for_each_linear_parameter(name):
    path = ImposedPath(T[:400], X[:400], np.gradient(X[:400], DT))
    model = FRICTION_MODELS[name].bound(path)
    shapes = np.sqrt([one.low * one.high for one in model.shapes(path)])
    columns = model.columns(path, shapes)
    assert columns.shape == (400, len(model.linear))
    assert np.isfinite(columns).all()


def test_the_true_model_is_found_with_its_parameters():
    found = br.compare_friction(rig(lugre()), models=["coulomb", "stribeck", "lugre"])
    values = {name: value for name, (value, _) in found.best.fit.values.items()}
    assert found.best.name == "lugre"
    assert found.best.held_out_n < 0.07 < found.rows[1].held_out_n < found.before_n[1]
    assert values["spring.K"] == pytest.approx(3e4, rel=0.02)
    assert values["lugre.fc"] == pytest.approx(15.0, rel=0.1)
    assert values["lugre.fc"] / values["lugre.z0"] == pytest.approx(2e5, rel=0.1)


def test_non_local_memory_is_told_from_one_bristle():
    found = br.compare_friction(rig(maxwell()), models=["lugre", "maxwell-slip"])
    assert [row.name for row in found.rows] == ["maxwell-slip", "lugre"]
    assert found.best.held_out_n < 0.5 * found.rows[1].held_out_n


def test_preisach_contains_maxwell_slip_and_knows_which_way_a_friction_leads():
    found = br.compare_friction(rig(maxwell()), models=["preisach", "maxwell-slip", "lugre"])
    errors = {row.name: row.held_out_n for row in found.rows}
    assert errors["preisach"] < 0.5 * errors["lugre"]
    assert errors["preisach"] < 0.04 * 23.0  # of the friction, with a grid of sixteen cells a side


def test_backlash_like_friction_keeps_its_condition_and_leaves_the_spring_to_the_valve():
    loop = SmoothBacklash(6e3, 8e4, 1e4, (X[0], 8e4 * X[0]))
    late = np.array([loop.update(x) for x in X])
    found = br.compare_friction(rig(11e4 * X - late + 20.0), models=["backlash-like", "coulomb"])
    values = {name: value for name, (value, _) in found.best.fit.values.items()}
    assert found.best.name == "backlash-like"
    assert found.best.held_out_n == pytest.approx(0.05, rel=0.2)
    assert values["spring.K"] == pytest.approx(11e4 - 8e4, rel=0.02)  # k - c: the two are one
    assert values["backlash-like.c - B1 up"] + values["backlash-like.c - B1 down"] == pytest.approx(7e4, rel=0.02)
    assert not any(name.startswith("backlash-like.k") for name in values)
    held = br.compare_friction(rig(11e4 * X - late + 20.0), models=["backlash-like"], without=["spring"])
    assert held.best.fit.values["backlash-like.k - c"][0] == pytest.approx(3e4, rel=0.02)


def test_bounded_least_squares_are_scipys():
    rng = np.random.default_rng(5)
    rows, target = rng.normal(size=(60, 9)), rng.normal(size=60)
    positive = np.arange(9) >= 3
    expected = lsq_linear(rows, target, (np.where(positive, 0.0, -np.inf), np.inf), method="bvls").x
    assert _least_squares(rows, target, positive) == pytest.approx(expected, abs=1e-8)
    assert (expected[3:] < 1e-12).any()


def test_a_recording_held_out_judges_and_the_answer_is_written(tmp_path):
    found = br.compare_friction(rig(lugre()), holdout=rig(maxwell()), models=["coulomb"], without=["spring"])
    assert found.split == "1 recording held out"
    found.write(tmp_path / "friction.json")
    written = json.loads((tmp_path / "friction.json").read_text("utf-8"))
    assert written["models"][0]["number_of_parameters"] == 2
    assert set(written["models"][0]["parameters"]) == {"spring.F0", "coulomb.a"}


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(BadParameter, match="there is no such model"):
        br.compare_friction(rig(lugre()), models=["dahl"])
    still = Recording.from_arrays(time=T, position=np.full(N, 0.01), force=np.zeros(N))
    with pytest.raises(BadInput):
        br.compare_friction(still, models=["coulomb"])


def test_the_command_prints_the_table(tmp_path, capsys):
    from bristle.cli.app import run

    out = tmp_path / "friction.json"
    assert run(["fit", "bundled:sine", "--friction", "coulomb", "--friction", "root", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "held out" in said
    assert "root" in said
    assert run(["fit", "bundled:sine", "--compare", "--given", "mass.m=2"]) == 2
    assert "--given" in capsys.readouterr().err
