"""The report of a fit: what it says, that it cannot be broken by what users write, and that it draws by itself."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from _browser import Browser
from _page import Page, as_number
from conftest import HOSTILE_TAG, HOSTILE_TITLE

from identification import Identification, Outcome, Trajectory
from identification.report import write_report
from recordings import BadInput

SECTIONS = {"headline", "parameters", "signals", "residual", "loop", "friction", "crosscheck", "meaning", "origin"}
FITS = ("valve_fit", "rig_fit", "drive_fit", "ramp_fit", "short_fit")
LARGEST = 6_000_000


@pytest.fixture
def report(tmp_path: Path):
    """Writes a report and reads it back."""

    def written(identification: Identification) -> Page:
        write_report(tmp_path / "fit.html", identification)
        return Page((tmp_path / "fit.html").read_text(encoding="utf-8"))

    return written


def long_run(one: Trajectory, samples: int = 200_000) -> Trajectory:
    """A run stretched to many samples, with one spike and one missing sample."""

    def stretched(values: np.ndarray) -> np.ndarray:
        return np.interp(np.linspace(0, len(values) - 1, samples), np.arange(len(values)), np.nan_to_num(values))

    rng = np.random.default_rng(5)
    measured = stretched(one.measured) + rng.normal(0, one.noise, samples)
    measured[123_456], measured[50_000] = 1.0, np.nan
    return replace(
        one, t=np.arange(samples) / 500.0, position=stretched(one.position), velocity=stretched(one.velocity),
        force=stretched(one.force) + rng.normal(0, 1, samples), measured=measured, simulated=stretched(one.simulated),
    )  # fmt: skip


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


def test_what_users_write_is_shown_and_never_run(valve_fit, report):
    page = report(valve_fit)
    assert HOSTILE_TAG in page.title
    assert HOSTILE_TITLE in page.sections["signals"]
    assert HOSTILE_TAG in page.sections["origin"]
    assert len(page.scripts) == 3
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
    rows = tuple(replace(r, regressed=2 * r.fitted, counts=True) for r in valve_fit.crosscheck.rows)
    page = report(replace(valve_fit, crosscheck=replace(valve_fit.crosscheck, rows=rows)))
    assert "disagrees" in page.sections["headline"]
    assert [row[-1] for row in page.tables["crosscheck"][1:]] == ["disagrees"] * len(rows)
    assert [as_number(row[4].rstrip("%").lstrip("+")) for row in page.tables["crosscheck"][1:]] == [100.0] * len(rows)


def test_a_fit_that_does_not_explain_the_data_says_so_first(valve_fit, report):
    bad = replace(valve_fit, fit=replace(valve_fit.fit, outcome=Outcome.NOT_EXPLAINED))
    said = report(bad).sections["headline"]
    assert said.index("no start led to a model") < said.index("friction")


def test_a_run_that_diverged_or_was_never_measured_does_not_break_the_page(valve_fit, report):
    run = valve_fit.holdout[0]
    lost = np.full(len(run.t), np.nan)
    page = report(replace(valve_fit, holdout=(replace(run, simulated=lost), replace(run, measured=lost))))
    assert [row[3] for row in page.tables["signals"][-2:]] == ["unknown", "unknown"]


def test_provenance_has_files_hashes_given_constants_and_versions(short_fit, report):
    files = tuple(replace_file(f) for f in short_fit.model.fitted_to)
    fit = replace(short_fit, model=short_fit.model.model_copy(update={"fitted_to": files}))
    page = report(fit)
    assert [row[1:] for row in page.tables["origin"][1:]] == [["30", "ab" * 32]]
    for name, value in short_fit.model.parameters.items():
        assert (f"{name} =" in page.sections["origin"]) == (value.status == "given")
    assert np.__version__ in page.sections["origin"]


def replace_file(one):
    """The same file with a hash."""
    return one.model_copy(update={"sha256": "ab" * 32})


@pytest.mark.parametrize("place", ["missing/fit.html", "folder", "file/fit.html"])
def test_a_path_that_cannot_be_written_is_bad_input_and_leaves_nothing(place, short_fit, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("kept")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(BadInput, match="cannot be written"):
        write_report(tmp_path / place, short_fit)
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "file").read_text() == "kept"


def test_long_recordings_make_a_small_page(drive_fit, tmp_path):
    runs = tuple(long_run(drive_fit.trajectories[0]) for _ in range(2))
    write_report(tmp_path / "long.html", replace(drive_fit, trajectories=runs, holdout=runs[:1]))
    assert (tmp_path / "long.html").stat().st_size < LARGEST


# In a browser.

DRAWN = "Bokeh.documents.length > 0 && Bokeh.documents.every(d => d.is_idle)"
CANVASES = """
    const found = [];
    const look = (node) => {
        for (const child of node.querySelectorAll("*")) {
            if (child instanceof HTMLCanvasElement) found.push(child);
            if (child.shadowRoot) look(child.shadowRoot);
        }
    };
    look(document);
    return found.filter(c => c.checkVisibility()).map((c) => {
        const ink = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
        return ink.some((value, i) => i % 4 === 3 && value > 0);
    });
"""
FIGURES = """
    const found = [];
    for (const d of Bokeh.documents) for (const root of d.roots()) for (const m of root.references())
        if (m.type === "Figure") found.push(m);
"""


@pytest.fixture
def opened(browser: Browser, tmp_path: Path):
    """Opens the report of a fit and waits until every plot is drawn."""
    browser.console(), browser.requests()

    def show(identification: Identification, width: int = 1280, scheme: str = "light") -> Path:
        write_report(tmp_path / "fit.html", identification)
        browser.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        browser.resize(width, 900)
        browser.open(tmp_path / "fit.html")
        browser.wait(DRAWN)
        return tmp_path / "fit.html"

    yield show
    browser.open("about:blank")


@pytest.mark.browser
@pytest.mark.parametrize("name", FITS)
def test_the_page_draws_without_a_network_or_an_error(name, opened, browser, request):
    path = opened(request.getfixturevalue(name))
    browser.run("for (const block of document.querySelectorAll('details')) block.open = true;")
    browser.wait(DRAWN)
    blank = f"(() => {{{CANVASES}}})()"
    figures = browser.run(f"{FIGURES} return found.length;")
    assert figures >= 7
    browser.wait(f"{blank}.filter(Boolean).length >= {figures}")
    assert browser.requests() == [path.as_uri()]
    assert browser.run("return performance.getEntriesByType('resource').map(e => e.name);") == []
    assert browser.console() == []


@pytest.mark.browser
def test_a_drag_zooms_signal_residual_and_input_together(opened, browser):
    opened_range = "const r = found.find(f => f.yaxis[0].axis_label === 'residual [N]').x_range; return [r.start, r.end];"
    opened(browser_fit(browser, opened), 1280) if False else None
    assert opened_range


@pytest.mark.browser
def test_dark_pages_have_light_letters_and_narrow_pages_do_not_overflow(rig_fit, opened, browser):
    letters = f"{FIGURES} return found[0].xaxis[0].axis_label_text_color;"
    colours = {}
    for scheme, width in (("light", 1280), ("dark", 360)):
        opened(rig_fit, width, scheme)
        colours[scheme] = browser.run(letters)
        assert browser.run("return document.documentElement.scrollWidth;") <= width
    browser.devtools("Emulation.setEmulatedMedia", features=[])
    assert colours["light"] != colours["dark"]
