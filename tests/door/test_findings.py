"""Results that are no model of a valve: each says itself in lines, in a notebook, in pictures and on a page."""

from __future__ import annotations

import pytest

import bristle as br
from identification.loops import simulated_loop


def _loop():
    loop = simulated_loop(6001, "stiction", "flow", "kano").loop
    signals = {"SP": loop.sp, "PV": loop.pv, "OP": loop.op}
    time = [loop.dt * k for k in range(len(loop.pv))]
    return br.Recording.from_arrays(time=time, extra=signals, units=dict.fromkeys(signals, "%"))


def _dated(folder):
    for month, friction in ((1, 100.0), (2, 104.0), (3, 108.0)):
        seen = br.simulate("sine:10", given={"lugre.fc": friction}, rate=50, seed=2)
        br.write(folder / f"2026-0{month}-01_valve.h5", seen)
    return folder


MADE = {
    "assess": (lambda folder: br.assess(_loop(), loop="flow"), "Control loop", 3),
    "compare": (lambda folder: br.compare("bundled:mixed", "bundled:mixed"), "Nothing changed", 2),
    "compare_free_runs": (lambda folder: br.compare_free_runs("bundled:step", models=["lugre"]), "lugre", 1),
    "compare_friction": (lambda folder: br.compare_friction("bundled:sine", models=["coulomb"]), "coulomb", 1),
    "follow": (lambda folder: br.follow(_dated(folder)), "A valve over time", 2),
    "test": (lambda folder: br.test("bundled:step", "step"), "Valve", 1),
}
"""By function of the door: a result, words of its table in a notebook, and how many pictures it has at least."""


@pytest.fixture(scope="module", params=MADE)
def made(request, tmp_path_factory):
    make, words, pictures = MADE[request.param]
    return make(tmp_path_factory.mktemp(request.param)), words, pictures


def test_it_is_shown_in_every_way(made, tmp_path):
    from bokeh.embed import file_html

    result, words, pictures = made
    assert "object at" not in repr(result)
    assert len(repr(result)) < 3000
    table = result._repr_html_()
    assert table.startswith("<table>")
    assert words in table
    assert "<script" not in table
    shown = result.plot()
    assert len(shown.children) >= pictures
    assert file_html(shown).lstrip().startswith("<!DOCTYPE html>")
    result.report(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8").lstrip().lower().startswith("<!doctype html>")
    with pytest.raises(br.BadInput, match="nowhere"):
        result.report(tmp_path / "nowhere" / "page.html")
