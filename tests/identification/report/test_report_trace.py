"""The report of a trace: it opens with the answer in words, how sure it is, and the error before and after."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from _browser import Browser
from _page import NARROW, Page, as_number
from report_samples import ANSWERS, IDLE, answered

from identification import Trace
from identification.report import figures, write_trace_report
from simulator import CATALOGUE

WIDTHS = (1400, 800, 400)


@pytest.fixture(scope="session")
def story(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Trace, Path]]:
    """A trace with some answer, and the path of its page."""
    folder, known = tmp_path_factory.mktemp("traces"), dict[str, tuple[Trace, Path]]()

    def written(name: str) -> tuple[Trace, Path]:
        if name not in known:
            found, path = answered(name), folder / f"{name}.html"
            write_trace_report(path, found)
            known[name] = found, path
        return known[name]

    return written


@pytest.fixture
def page_of(story) -> Callable[[str], tuple[Trace, Page]]:
    """The same with the page read."""

    def read(name: str) -> tuple[Trace, Page]:
        found, path = story(name)
        return found, Page(path.read_text(encoding="utf-8"))

    return read


@pytest.mark.parametrize("name", ANSWERS)
def test_the_page_opens_with_the_answer_and_how_sure_it_is(name, page_of):
    _, page = page_of(name)
    first, second, *_ = page.sections
    opening, said = page.sections[first], page.sections[second]
    assert second == "answer"
    assert opening.index(ANSWERS[name]) < opening.index("Confidence:") < opening.index("Next:")
    assert re.search(r"Confidence: *(Sure|Likely|Tentative)", opening)
    assert ANSWERS[name] not in said  # once is enough
    assert "What the answer rests on" in said
    assert not [effect for effect in CATALOGUE.ids if "_" in effect and effect in said]
    assert "nan" not in " ".join(page.sections.values()).lower().split()


@pytest.mark.parametrize("name", ANSWERS)
def test_errors_before_and_after_have_their_unit(name, page_of):
    found, page = page_of(name)
    said = page.sections["answer"].replace(NARROW, "")
    sides = ("before", "after") if found.effects_added else ("before",)
    label = "Error {}" if found.effects_added else "Error of the free run"
    for side in sides:
        value, unit = re.search(rf"{label.format(side)} ([\d.×⁻⁰-⁹]+) (µm|mm|N)", said).groups()
        factor = {"µm": 1e6, "mm": 1e3, "N": 1.0}[unit]
        error = found.error[side][found.reported][f"rmse_{found.unit}"]
        assert as_number(value) / factor == pytest.approx(error, rel=0.01)


def test_a_named_effect_is_sized_and_what_to_check_on_site_is_said(page_of):
    _, page = page_of("named")
    said = page.sections["answer"]
    assert re.search(r"cubic stiffness: \d+ ± \d+N/m³", said.replace(NARROW, ""))
    assert CATALOGUE["hardening_spring"].check in said


def test_effects_that_look_alike_are_named_with_what_to_check(page_of):
    _, page = page_of("class")
    said = page.sections["answer"]
    assert "one of 2 effects that look alike here" in next(iter(page.sections.values()))
    assert CATALOGUE["flow_force"].check in said


def test_what_only_held_out_recordings_show_says_what_to_measure_next(page_of):
    found, page = page_of("unlisted")
    said = page.sections["answer"]
    assert "Measure next" in said
    assert f"Record more like {found.base.holdout[0].name}" in said
    assert re.search(r"acts like a force of [\d.]+ N rms", said)


def test_where_nothing_is_missing_no_picture_stands_open(page_of):
    _, page = page_of("none")
    assert "It depends on nothing that was recorded" in page.sections["pictures"]
    assert "More pictures" in page.sections["pictures"]


def test_the_pictures_that_show_the_effect_come_first_and_say_how_much_they_explain(page_of):
    _, page = page_of("named")
    shown = page.sections["pictures"].split("More pictures")[0].replace(NARROW, " ")
    shares = [float(share) for share in re.findall(r"([\d.]+) % of the variance", shown)]
    assert shares == sorted(shares, reverse=True)
    assert 1 <= len(shares) <= 3
    assert min(shares) >= 10


def test_the_model_that_came_out_is_not_said_to_lack_something(page_of):
    _, page = page_of("named")
    rest = " ".join(text for name, text in page.sections.items() if name not in ("answer", "pictures", "candidates"))
    assert "the model lacks" not in rest.replace("the model lacks something", "", 1)
    assert "residual" not in page.sections


@pytest.mark.parametrize("name", ["named", "imposed"])
def test_a_notebook_gets_the_curves_before_and_after(name, page_of):
    found, _ = page_of(name)
    shown = figures(found)
    assert len(shown) == 2
    for plot in shown.values():
        names = [item.label.value for item in plot.legend.items]
        assert names[-2:] == ["model before", "model after"]
        assert re.search(r"\[(mm|µm|N)\]$", plot.yaxis[0].axis_label.text)
        assert all(np.isfinite([plot.y_range.start, plot.y_range.end]))


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.parametrize("name", ANSWERS)
def test_the_page_draws_by_itself_and_nothing_overlaps_at_any_width(name, story, browser: Browser):
    _, path = story(name)
    browser.open("about:blank")
    browser.console(), browser.requests()
    for width in WIDTHS:
        browser.resize(width, 900)
        browser.open(path)
        browser.wait(IDLE)
        browser.run("for (const block of document.querySelectorAll('details')) block.open = true;")
        browser.wait(IDLE)
        assert browser.run("return document.documentElement.scrollWidth;") == width
        assert browser.overlapping() == []
        first = "#errors" if width > 400 else "#opening"  # a telephone shows the answer, then the errors
        assert browser.run(f"return document.querySelector('{first}').getBoundingClientRect().bottom;") < 900
    assert set(browser.requests()) == {path.as_uri()}
    assert browser.console() == []
    assert browser.lost_on_a4(path) == []
