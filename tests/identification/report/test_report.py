"""The report of a fit: what it says and that what users write cannot break it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from _page import Page, as_number
from own_effect import found as own_effect_fit
from report_samples import HOSTILE_TAG, HOSTILE_TITLE, long_run

from identification import Identification, Outcome
from identification.report import figures, write_report
from recordings import BadInput

SECTIONS = {"headline", "parameters", "signals", "residual", "loop", "friction", "crosscheck", "meaning", "origin"}
FITS = ("valve_fit", "rig_fit", "drive_fit", "ramp_fit", "short_fit")
LARGEST = 6_000_000


@pytest.fixture(scope="session")
def report(written):
    """Writes the report of a fit and reads it."""
    known: dict[Path, Page] = {}

    def read(identification: Identification) -> Page:
        path = written(identification)
        if path not in known:
            known[path] = Page(path.read_text(encoding="utf-8"))
        return known[path]

    return read


@pytest.mark.parametrize("name", FITS)
def test_every_fit_has_a_whole_page_that_needs_nothing_from_elsewhere(name, report, request):
    fit = request.getfixturevalue(name)
    page = report(fit)
    assert {s for s in page.sections if s} == SECTIONS
    assert all(page.sections[s].strip() for s in SECTIONS)
    assert "nan" not in " ".join(page.sections.values()).lower().split()
    assert all(a.startswith(("#", "data:")) for a in page.addresses)
    assert ("html", "lang", "en") in page.attributes
    policy = next(value for _, name, value in page.attributes if name == "content" and "default-src" in value)
    assert "default-src 'none'" in policy
    assert not re.search(r"url\(|@import", "".join(page.sections.values()))


@pytest.mark.parametrize("name", FITS)
def test_the_parameter_table_has_every_value_with_its_uncertainty_and_status(name, report, request):
    model = request.getfixturevalue(name).model
    _, *rows = report(request.getfixturevalue(name)).tables["parameters"]
    assert [row[0].split()[0] for row in rows] == list(model.parameters)
    for row, (parameter, known) in zip(rows, model.parameters.items(), strict=True):
        assert as_number(row[1]) == pytest.approx(known.value, rel=1e-2, abs=known.std or 1e-9)
        assert row[3] == known.unit
        if known.std is None:
            assert row[2] == "–", parameter
            continue
        assert as_number(row[2]) == pytest.approx(known.std, rel=0.1, abs=1e-6 * abs(known.value))
        low, high = (as_number(text) for text in row[4].split(" … "))
        assert low < known.value < high
        assert low >= 0 or known.lower is None
        assert known.status.replace("_", " ")[:4] in row[6]


def test_the_headline_tells_the_valve_in_the_terms_of_its_trade(valve_fit, report):
    said = report(valve_fit).sections["headline"].replace("\N{NARROW NO-BREAK SPACE}", " ")
    p, plant = valve_fit.model.values, valve_fit.model.plant
    span = p["spring.K"] * plant["stroke_m"]
    for figure, words in [
        (p["lugre.fc"], "N of friction"), (100 * p["lugre.fc"] / span, "% of span"), (p["spring.K"] / 1e3, "N/mm"),
        (p["spring.F0"], "N of preload"), (2e3 * p["lugre.fc"] / p["spring.K"], "mm,"),
        ((p["spring.F0"] + span) / plant["diaphragm_area_m2"] / 1e3, "kPa"),
    ]:  # fmt: skip
        found = re.search(rf"([\d.]+) {re.escape(words)}", said)
        assert found, words
        assert float(found[1]) == pytest.approx(figure, rel=0.01)
    ratio = float(re.search(r"\(([\d.]+) times the noise floor\)", said)[1])
    assert ratio == pytest.approx(valve_fit.fit.rms, rel=0.02)
    assert valve_fit.crosscheck.sentence in said


def test_every_parameter_gets_its_sentence_and_every_effect_its_check(valve_fit, report):
    said = report(valve_fit).sections["meaning"]
    assert all(name in said for name in valve_fit.model.parameters)
    assert "packing torque" in said
    assert "bench set" in said


def test_what_users_write_is_shown_and_never_run(valve_fit, rig_fit, report):
    page = report(valve_fit)
    assert HOSTILE_TAG in page.title
    assert HOSTILE_TITLE in page.sections["signals"]
    assert HOSTILE_TAG in page.sections["origin"]
    assert len(page.scripts) == len(report(rig_fit).scripts)
    assert not any(script.strip().startswith("alert") for script in page.scripts)
    assert not any(name.startswith("on") for _, name, _ in page.attributes)
    assert all(element != "img" for element, _, _ in page.attributes)


def test_gaps_missing_samples_and_held_out_recordings_are_named(valve_fit, report):
    page = report(valve_fit)
    said, rows = page.sections["signals"], page.tables["signals"][1:]
    assert "40 samples of the position are missing" in said
    assert "2 stretches" in said
    assert [row[0].rsplit("(", 1)[1] for row in rows] == ["fitted)", "fitted)", "held out)"]
    for row, run in zip(rows, (*valve_fit.trajectories, *valve_fit.holdout), strict=True):
        assert as_number(row[3]) == pytest.approx(1e6 * run.rmse, rel=0.01)
        assert as_number(row[6]) == pytest.approx(run.rmse / run.noise, rel=0.01)


def test_a_motion_driven_fit_speaks_of_force(rig_fit, report):
    page = report(rig_fit)
    assert "simulated force misses the measured one by" in page.sections["headline"]
    assert "rms [N]" in page.tables["signals"][0]
    assert "the model predicts the force" in page.sections["loop"]
    assert "motion-driven" in page.sections["origin"]


def test_a_plant_without_spring_has_no_dead_band_and_is_judged_over_its_windows(drive_fit, report):
    page = report(drive_fit)
    said = page.sections["headline"]
    assert "has no spring" in said
    assert "Dead band" not in said
    assert "over windows of 0.01 s" in said
    assert "held, not fitted" in " ".join(page.tables["parameters"][2])
    assert "Without a spring" in page.sections["loop"]


def test_weak_parameters_are_marked_and_the_experiment_that_pins_them_is_named(ramp_fit, report):
    weak = [n for n, p in ramp_fit.model.parameters.items() if p.status == "weak"]
    assert weak
    page = report(ramp_fit)
    for sentence in ramp_fit.advice:
        assert sentence in page.sections["headline"]
    for row in page.tables["parameters"][1:]:
        assert ("weak" in row[6]) == (row[0].split()[0] in weak)
    assert "weakly known" in page.sections["headline"] or not {"lugre.fc", "lugre.fs", "spring.K"} & set(weak)


def test_a_page_without_cross_check_says_why(short_fit, report):
    page = report(short_fit)
    assert "There is no cross-check" in page.sections["crosscheck"]
    assert not page.tables["crosscheck"]


def test_a_cross_check_that_disagrees_is_said_first_and_in_its_table(valve_fit, report):
    rows = tuple(replace(r, regressed=2 * r.fitted + r.allowed, counts=True) for r in valve_fit.crosscheck.rows)
    rows = tuple(replace(r, fitted_half=0.0, regressed_half=0.0, allowed=0.5 * abs(r.difference)) for r in rows)
    page = report(replace(valve_fit, crosscheck=replace(valve_fit.crosscheck, rows=rows)))
    assert "disagrees" in page.sections["headline"]
    assert [row[-1] for row in page.tables["crosscheck"][1:]] == ["disagrees"] * len(rows)
    shown = [as_number(row[4]) for row in page.tables["crosscheck"][1:]]
    assert shown == pytest.approx([row.difference for row in rows], rel=0.05)
    assert "Mass, presliding and break-away" in page.sections["crosscheck"]


def test_a_fit_that_does_not_explain_the_data_says_so_first(valve_fit, report):
    bad = replace(valve_fit, fit=replace(valve_fit.fit, outcome=Outcome.NOT_EXPLAINED))
    said = report(bad).sections["headline"].lower()
    assert said.index("no start led to a model") < said.index("friction")


def test_a_run_that_diverged_or_was_never_measured_does_not_break_the_page(valve_fit, report):
    run = valve_fit.holdout[0]
    lost = np.full(len(run.t), np.nan)
    page = report(replace(valve_fit, holdout=(replace(run, simulated=lost), replace(run, measured=lost))))
    assert [row[3] for row in page.tables["signals"][-2:]] == ["unknown", "unknown"]


def test_provenance_has_files_hashes_given_constants_and_versions(short_fit, report):
    files = tuple(f.model_copy(update={"sha256": "ab" * 32}) for f in short_fit.model.fitted_to)
    fit = replace(short_fit, model=short_fit.model.model_copy(update={"fitted_to": files}))
    page = report(fit)
    assert [row[1:] for row in page.tables["origin"][1:]] == [["30", "ab" * 32]]
    for name, value in short_fit.model.parameters.items():
        assert (f"{name} =" in page.sections["origin"]) == (value.status == "given")
    assert np.__version__ in page.sections["origin"]


def test_a_file_name_that_is_not_text_does_not_stop_the_report(short_fit, report):
    odd = replace(short_fit, trajectories=(replace(short_fit.trajectories[0], name="caf\udce9.h5"),))
    assert "1: caf?.h5 (fitted)" in report(odd).sections["signals"]


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("missing/fit.html", "the folder does not exist"),
        ("folder", "it is a directory"),
        ("file/fit.html", "its folder is a file"),
        (".", "it is a directory"),
    ],
)
def test_a_path_that_cannot_be_written_is_bad_input_and_leaves_nothing(place, words, short_fit, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("kept")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(BadInput, match=words):
        write_report(tmp_path / place, short_fit)
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "file").read_text() == "kept"


def test_long_recordings_make_a_small_page(drive_fit, tmp_path):
    runs = tuple(long_run(drive_fit.trajectories[0]) for _ in range(2))
    write_report(tmp_path / "long.html", replace(drive_fit, trajectories=runs, holdout=runs[:1]))
    assert (tmp_path / "long.html").stat().st_size < LARGEST


@pytest.mark.parametrize("name", FITS)
def test_a_notebook_gets_the_main_pictures_of_a_fit_with_units(name, request):
    shown = figures(request.getfixturevalue(name))
    assert list(shown)[:2] == ["Measured and simulated", "Valve signature: force against position"]
    for plot in shown.values():
        assert re.search(r"\[.+\]$", plot.xaxis[0].axis_label.text)
        assert re.search(r"\[.+\]$", plot.yaxis[0].axis_label.text)


def test_an_effect_of_ones_own_gets_its_sentence_and_its_check(report):
    said = report(own_effect_fit(0.0)).sections["meaning"]
    assert "the spring hardens along the stroke" in said
    assert "cubic stiffness: " in said
    assert "coils that touch" in said
