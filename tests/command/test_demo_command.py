"""`bristle demo`: the main job on what ships with the toolkit."""

from __future__ import annotations

from recordings import bundled_path, read_truth
from simulator import ValveModel


def test_it_identifies_the_bundled_valve_and_shows_the_truth_beside_it(console, tmp_path):
    ending = console("demo", "--out", tmp_path / "here")
    assert ending.code == 0
    assert ending.err == []
    assert "truth" in ending.out
    assert "sparse regression agrees" in ending.out
    model, page = tmp_path / "here" / "model.json", tmp_path / "here" / "report.html"
    assert str(model) in ending.out
    assert str(page) in ending.out
    truth = read_truth(bundled_path("step"))
    for name, parameter in ValveModel.read(model).parameters.items():
        assert abs(parameter.value - truth[name]) < 4.5 * parameter.std
        assert abs(parameter.value / truth[name] - 1) < 0.02
    assert page.stat().st_size > 10_000


def test_a_folder_that_cannot_be_made_is_refused(console, tmp_path):
    (tmp_path / "file").write_text("")
    assert "cannot be made" in console.refused("demo", "--out", tmp_path / "file" / "here")
