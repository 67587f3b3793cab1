"""What the reports open with: a verdict in one word, how sure it is, what to do next; and that they print on A4."""

from __future__ import annotations

from dataclasses import replace

import pytest

import bristle as br
from identification.loops import simulated_loop
from identification.report.openings import comparison_opening


@pytest.fixture(scope="module")
def compared():
    return br.compare("bundled:mixed", "bundled:step")


@pytest.fixture(scope="module")
def stepped():
    return br.test("bundled:step", "step")


def opening_of(page: str) -> str:
    """The block that the page opens with."""
    return page[page.index('id="opening"') : page.index("</header>")]


def test_a_comparison_without_a_change_is_good(compared):
    opening = comparison_opening(compared)
    assert (opening.word, compared.tag) == ("good", "example")
    assert "nothing changed" in opening.why
    assert opening.sure
    assert opening.action


@pytest.mark.parametrize(("factor", "word"), [(1.3, "watch"), (1.8, "repair"), (0.4, "watch")])
def test_how_much_friction_grew_decides_about_work(compared, factor, word):
    quantities = []
    for one in compared.quantities:
        if one.name == "friction":
            after = replace(one.after, value=factor * one.before.value)
            change = after.value - one.before.value
            one = replace(one, after=after, lower=0.9 * change, upper=1.1 * change)
            one = replace(one, lower=min(one.lower, one.upper), upper=max(one.lower, one.upper))
        quantities.append(one)
    changed = replace(compared, quantities=tuple(quantities), alike=True)
    assert comparison_opening(changed).word == word
    assert comparison_opening(replace(changed, alike=False)).word == "watch"


def test_pages_open_with_tag_date_verdict_confidence_and_action(compared, stepped, tmp_path):
    loop = br.assess(_recorded(simulated_loop(6001, "stiction", "flow", "kano").loop), loop="flow")
    for found, heading, word in (
        (compared, "Valve example: before and after", "Good"),
        (stepped, "Valve example: step test", "Good"),
        (loop, "Control loop", "Repair"),
    ):
        found.report(tmp_path / "page.html")
        page = (tmp_path / "page.html").read_text()
        opening = opening_of(page)
        assert heading in page
        assert "Report of 20" in page[: page.index('id="opening"')]
        assert f"{word}</strong>" in opening
        assert "Confidence:" in opening
        assert "Next:" in opening


def test_a_failed_partial_stroke_asks_for_repair(stepped, tmp_path):
    failed = replace(stepped, kind="partial-stroke", values={"abort_reasons": ("the stem did not move",)})
    failed.report(tmp_path / "page.html")
    assert "Repair</strong>: the partial stroke failed: the stem did not move" in opening_of(
        (tmp_path / "page.html").read_text()
    )


@pytest.mark.slow
@pytest.mark.browser
def test_pages_print_on_a4_with_nothing_cut(compared, stepped, browser, tmp_path):
    loop = br.assess(_recorded(simulated_loop(6001, "stiction", "flow", "kano").loop), loop="flow")
    for name, found in (("compared", compared), ("stepped", stepped), ("loop", loop)):
        found.report(tmp_path / f"{name}.html")
        assert browser.lost_on_a4(tmp_path / f"{name}.html") == [], name
    assert 1 <= browser.printed().count(b"/Type /Page\n") <= 6


def _recorded(loop):
    extra = {"SP": loop.sp, "PV": loop.pv, "OP": loop.op}
    time = [loop.dt * k for k in range(len(loop.pv))]
    return br.Recording.from_arrays(time=time, extra=extra, units=dict.fromkeys(extra, "%"))
