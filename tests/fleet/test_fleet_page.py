"""The page of a fleet: who leads each ranking, outliers, pooled estimates, links; from rows that are known."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.fleet.page import write_fleet_page
from bristle.fleet.ranking import ranked, types_of_valves

BLANK = {"type": "globe", "state": "done", "sentence": "fine", "page": None}


def row(valve, year, fc, k, **more):
    found = {"lugre.fc": fc, "lugre.fc.std": 0.02 * fc, "lugre.fc.status": "identified"}
    found |= {"spring.K": k, "spring.K.std": 0.001 * k, "spring.K.status": "identified"}
    place = {"valve": valve, "date": f"{year}-06-01T00:00:00", "recordings": f"{valve}-{year}.h5"}
    place |= {"key": f"{valve}{year}"}
    return {**BLANK, **place, **found, **more}


@pytest.fixture(scope="module")
def rows():
    """Twelve valves over four years: FV-03 grows in friction, FV-05 lost spring rate, FV-07 is badly known."""
    random, made = np.random.default_rng(601), []
    for number in range(12):
        for years in range(4):
            fc = 100.0 * np.exp(random.normal(0.0, 0.03) + (0.2 * years if number == 3 else 0.0))
            k = 6e4 * np.exp(random.normal(0.0, 0.001) - (0.1 if number == 5 and years == 3 else 0.0))
            more = {"lugre.fc.std": 80.0} if number == 7 else {}
            page = {"page": f"FV-{number:02d}.html"} if years == 3 else {}
            made.append(row(f"FV-{number:02d}", 2022 + years, fc, k, **more, **page))
    blank = {"valve": "FV-99", "date": None, "recordings": "FV-99.h5", "key": "x"}
    return [*made, {**BLANK, **blank, "state": "refused", "sentence": "it is <empty>"}]


def test_the_rankings_find_those_that_stand_out(rows):
    valves = {one.valve: one for one in ranked(rows)}
    assert max(valves.values(), key=lambda v: v.friction.slope / v.friction.std if v.friction else 0).valve == "FV-03"
    assert valves["FV-03"].friction.slope == pytest.approx(0.2, abs=3 * valves["FV-03"].friction.std)
    assert min(valves.values(), key=lambda v: v.spring.p if v.spring else 1).valve == "FV-05"
    assert valves["FV-05"].spring.value == pytest.approx(-0.1, abs=0.01)
    assert valves["FV-07"].weakest[0] == "lugre.fc"
    assert valves["FV-99"].friction is None


def test_outliers_and_pooled_estimates_are_of_the_newest_recordings_of_a_type(rows):
    (globe,) = types_of_valves(rows, 0.05)
    tags = [one["valve"] for one in globe.rows]
    assert len(tags) == 12
    odd = {name: [tags[k] for k in np.flatnonzero(one.told)] for name, one in globe.outliers.items()}
    assert odd == {"lugre.fc": ["FV-03"], "spring.K": ["FV-05"]}
    together, own = globe.pooled["lugre.fc"], dict(zip(tags, globe.quantities[0].scaled[1], strict=True))
    assert together.std[tags.index("FV-07")] < 0.6 * own["FV-07"]


def test_the_page_says_it_and_leads_to_the_valves(rows, tmp_path):
    write_fleet_page(tmp_path / "fleet.html", "fit", rows, tmp_path / "valves")
    page = (tmp_path / "fleet.html").read_text()
    assert page.count('href="valves/FV-03.html"') >= 3
    for title in ("Friction trend", "Change of spring rate", "Weakest evidence", "Distributions, type globe", "Pooled"):
        assert title in page
    assert "it is &lt;empty&gt;" in page
    assert "as priors: lugre.fc=" in page
    assert "49 recording sets of 13 valves: 48 done, 1 refused." in page


def test_a_fleet_without_any_result_has_a_page(tmp_path):
    alone = {"valve": "V", "date": None, "recordings": "V.h5", "key": "x"}
    rows = [{**BLANK, **alone, "state": "refused", "sentence": "no", "type": ""}]
    write_fleet_page(tmp_path / "fleet.html", "assess", rows, None)
    assert "1 recording sets of 1 valves: 1 refused." in (tmp_path / "fleet.html").read_text()


def test_loops_are_ranked_by_the_probability_of_stiction(tmp_path):
    rows = [
        {**BLANK, "valve": f"FIC-{k}", "date": None, "recordings": f"{k}.csv", "key": str(k), "verdict": verdict,
         "probability": probability, "type": "flow"}
        for k, (verdict, probability) in enumerate([("no_stiction", 0.1), ("stiction", 0.9), ("cannot_tell", None)])
    ]  # fmt: skip
    write_fleet_page(tmp_path / "fleet.html", "assess", rows, None)
    page = (tmp_path / "fleet.html").read_text()
    assert page.index("FIC-1") < page.index("FIC-0")
