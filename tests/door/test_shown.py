"""What the values of the door are at the prompt and in a notebook: short, and without orders from outside."""

from __future__ import annotations

import numpy as np
import pytest

import bristle as br
from detector import described

SHORT = 400
"""Characters that a value may take at the prompt."""


@pytest.fixture(scope="module")
def recording():
    return br.simulate("sine:60,mixed:60", rate=50, position_noise=5e-6, seed=3)


@pytest.fixture(scope="module")
def learned(recording):
    return br.learn(recording, false_alarms=1000.0)


def test_a_detector_says_what_it_watches_and_how_often_it_is_wrong(learned):
    assert repr(learned).startswith("<Watch of force, position: observer; false alarms: ")
    assert len(repr(learned)) < SHORT
    page = learned._repr_html_()
    assert page.startswith("<pre>observer: input force")
    assert page.count("\n") == described(learned).count("\n")


def test_a_recording_is_drawn(recording):
    from bokeh.embed import file_html

    shown = recording.plot()
    assert len(shown.children) == 3  # force, position, and the loop of the two
    assert file_html(shown).lstrip().startswith("<!DOCTYPE html>")
    alone = br.Recording.from_arrays(time=[0.0, 0.1, 0.2], position=[0.0, 1.0, 2.0])
    assert len(alone.plot().children) == 1


def test_a_recording_is_a_table_in_a_notebook():
    recording = br.Recording.from_arrays(
        time=[0.0, 0.1, 0.2], position=[0.0, np.nan, 2e-3], force=[1.0, 2.0, 3.0], title="<script>alert(1)</script>"
    )
    page = recording._repr_html_()
    assert page.startswith("<table>")
    assert page.endswith("</table>")
    assert page.count("<tr>") == 4
    assert "<td>position</td><td>output</td><td>m</td><td>0</td><td>0.002</td><td>1</td>" in page
    assert "<script" not in page


def test_a_catalogue_says_its_effects():
    assert repr(br.CATALOGUE).startswith(f"<Catalogue of {len(br.CATALOGUE.effects)} effects: inertia, spring, lugre, ")
    assert "object at" not in repr(br.CATALOGUE)


def test_a_model_says_its_effects_and_values():
    from simulator import BASE, Value

    values = {"mass.m": Value(value=2.0, unit="kg"), "spring.K": Value(value=61234.5, unit="N/m")}
    model = br.ValveModel(effects=BASE, parameters=values)
    assert repr(model) == "<ValveModel of inertia, spring, lugre: mass.m 2 kg, spring.K 6.123e+04 N/m>"
