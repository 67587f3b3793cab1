"""Friction models as valves that a recorded force drives: the true one leads, what cannot be run is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

import bristle as br
from identification import FREE_FRICTION_MODELS, FRICTION_MODELS
from identification.friction.free_run import REFUSED
from recordings import BadInput, BadParameter, Recording
from simulator import Excitation, Sensors, random_valve, simulate


@pytest.mark.slow
@pytest.mark.parametrize("true", ["lugre", "coulomb"])
def test_the_true_model_leads_or_is_as_good_as_what_contains_it(true, tmp_path):
    values, stroke = random_valve(11)
    flat = {"lugre.fs": values["lugre.fc"], "lugre.sigma2": 0.0} if true == "coulomb" else {}
    recording, _ = simulate(
        {**values, **flat}, Excitation.parse("sine:10"), Sensors(200.0, position_noise=1e-4 * stroke), stroke=stroke,
        seed=11,
    )  # fmt: skip
    found = br.compare_free_runs(recording, models=["coulomb", "lugre"])
    errors = {row.name: row.held_out_m for row in found.rows}
    assert errors[true] < 1.1 * 1e-4 * stroke
    if true == "lugre":
        assert found.best.name == "lugre"
        assert errors["coulomb"] > 2 * errors["lugre"]
    found.write(tmp_path / "friction.json")
    written = json.loads((tmp_path / "friction.json").read_text("utf-8"))
    assert {one["model"]: one["holdout_rmse_m"] for one in written["models"]} == pytest.approx(errors)


def test_every_model_can_be_run_or_is_refused_with_the_reason():
    assert {*FREE_FRICTION_MODELS} | {*REFUSED} == {*FRICTION_MODELS}
    for name, why in REFUSED.items():
        with pytest.raises(BadParameter, match=f"{name}: it cannot be run freely: {why}"):
            br.compare_free_runs("bundled:step", models=[name])
    with pytest.raises(BadParameter, match="there is no such model"):
        br.compare_free_runs("bundled:step", models=["dahl"])


def test_an_imposed_motion_has_no_free_run():
    t = 0.01 * np.arange(500)
    rig = Recording.from_arrays(
        time=t, position=0.01 * np.sin(t), force=np.cos(t), roles={"position": "input", "force": "output"}
    )
    with pytest.raises(BadInput, match=r"its motion is imposed.*compare the force instead"):
        br.compare_free_runs(rig)


def test_options_of_another_fit_are_refused(capsys):
    from bristle.cli.app import run

    assert run(["fit", "bundled:step", "--free-run", "--without", "spring"]) == 2
    assert "--without" in capsys.readouterr().err
