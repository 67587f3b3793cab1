"""`bristle test` at the console: exit codes and files."""

from __future__ import annotations

import json

import numpy as np

import bristle as br


def test_a_step_test_of_a_bundled_recording(console, tmp_path):
    ending = console(
        "test", "bundled:step", "--kind", "step", "--out", tmp_path / "t.json", "--report", tmp_path / "t.html"
    )
    assert ending.code == 0
    assert "T86_s" in ending.out
    content = json.loads((tmp_path / "t.json").read_text())
    assert set(content["values"]["steps"][0]["Td_s"]) == {"value", "lower", "upper"}
    again = console("test", "bundled:step", "--kind", "step", "--reference", tmp_path / "t.json")
    assert "nothing changed" in again.out


def test_a_failed_partial_stroke_is_a_negative_answer_with_its_file(console, tmp_path):
    t = np.arange(0.0, 60.0, 0.1)
    setpoint = np.where((t >= 10) & (t < 35), 0.9, 1.0)
    position = 100.0 + np.random.default_rng(1).normal(0.0, 0.02, len(t))
    br.write(
        tmp_path / "r.h5",
        br.Recording.from_arrays(time=t, setpoint=setpoint, position=position, units={"position": "%"}),
    )
    ending = console("test", tmp_path / "r.h5", "--kind", "partial-stroke", "--out", tmp_path / "t.json")
    assert ending.code == 1
    assert "did not break away" in ending.complaint
    assert json.loads((tmp_path / "t.json").read_text())["values"]["abort_reasons"]


def test_what_cannot_be_tested_is_refused(console):
    assert "use step, deadband" in console.refused("test", "bundled:step", "--kind", "stroke")
    assert "slow stroke up and down" in console.refused("test", "bundled:step", "--kind", "signature")
    assert "no such file" in console.refused("test", "nowhere.h5", "--kind", "step")
