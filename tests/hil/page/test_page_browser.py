"""The live page in a browser: what it shows, on wide and narrow screens, and that it says when data stop."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from _browser import Browser, is_this_machine
from page_rig import BEGAN, Shown, alarmed, link, served, valve

from hil.page import Page
from hil.service.status import Health, TaskStatus
from recordings import Recording, Signal, write


def errors(browser: Browser) -> list[str]:
    """Errors on the console. A drawing that has no data yet only warns."""
    return [said for said in browser.console() if said.startswith("SEVERE")]


pytestmark = pytest.mark.browser

BEATING = "Number(document.body.dataset.beats) > 2"
ODD = "PV-7 (a.b) <i>"
TAGS = "return [...document.querySelectorAll('.which a')].map(a => a.textContent);"
FIGURE = "Bokeh.documents[0].get_model_by_name('{}')"


def plant() -> Shown:
    """One valve of every state."""
    return Shown(
        valve("LC74_20"),
        valve("TV-3", Health.CHECK, phase="learning", reason="it is still being learned"),
        valve("XV-9", Health.OUT_OF_SPEC, reason="the supply pressure is not usual"),
        valve(ODD, Health.FAILURE, reason="the position cannot be believed"),
        alarmed("FV-101"),
    )


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    """A folder with a recording of one valve and one of another."""
    folder = tmp_path_factory.mktemp("recorded")
    t = np.arange(0.0, 60.0, 0.1)
    signals = [Signal("time", t, "s", "time"), Signal("position", 0.02 + 0.01 * np.sin(t), "m", "output")]
    made = replace(Recording.of(signals), created=BEGAN)
    for tag in ("FV-101", "FV-101-B"):
        write(folder / f"{tag}-20261123T080000Z-001.h5", made)
    return folder


@pytest.fixture(scope="module")
def shown() -> Shown:
    return plant()


@pytest.fixture(scope="module")
def page(shown, recorded) -> Iterator[Page]:
    with served(shown, recordings=recorded) as page:
        yield page


@pytest.fixture
def opened(browser: Browser, page: Page) -> Browser:
    """The overview, alive."""
    browser.open("about:blank")
    browser.console(), browser.requests()
    browser.resize(1280, 900)
    browser.open(page.url)
    browser.wait(BEATING)
    return browser


def test_all_valves_the_worst_first_each_by_letter_shape_and_words(opened):
    assert opened.run(TAGS) == [ODD, "TV-3", "XV-9", "FV-101", "LC74_20"]
    badges = opened.run(
        "return [...document.querySelectorAll('li .badge')].map(b => [b.innerText.replace(/\\s+/g, ' ').trim(),"
        " b.querySelector('svg').innerHTML, b.querySelector('svg').getAttribute('fill')]);"
    )
    words = ["F failure", "C check function", "S out of specification", "M maintenance required", "good"]
    assert [badge[0] for badge in badges] == words
    assert len({badge[1] for badge in badges}) == len({badge[2] for badge in badges}) == 5
    text = opened.run("return document.body.innerText;")
    assert "Unit 7 <b>" in text
    assert "The supply pressure is not usual." in text
    assert "Since 2026-11-23 08:01:10 UTC" in text or "Since 08:01:10 UTC" in text
    assert "19.12" in text
    assert errors(opened) == []


def test_everything_comes_from_its_own_process(opened, page):
    asked = opened.requests()
    assert any("bokeh.min.js" in one for one in asked)
    assert {one.split("/")[2] for one in asked} == {page.url.split("/")[2]}
    assert all(is_this_machine(one) for one in asked)
    tried = "return fetch(arguments[0]).then(() => 'came', () => 'refused');"
    assert opened.run(tried, "http://localhost:9/") == "refused"  # by the policy of the page, whatever is there
    assert any("Content Security Policy" in said for said in opened.console())


@pytest.mark.slow
def test_by_keyboard_from_the_overview_to_a_valve_and_back(opened):
    def press(key: str, code: int) -> None:
        for kind in ("keyDown", "keyUp"):
            opened.devtools(
                "Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code,
                text="\r" if key == "Enter" else "",
            )  # fmt: skip

    press("Tab", 9)
    assert opened.run("return document.activeElement.className;") == "skip"
    press("Tab", 9)
    assert opened.run("return document.activeElement.textContent;") == ODD
    opened.wait(f"Number(document.body.dataset.beats) > {opened.run('return document.body.dataset.beats;')} + 2")
    assert opened.run("return document.activeElement.textContent;") == ODD
    press("Enter", 13)
    opened.wait(f"location.pathname === '/valve' && {BEATING}")
    assert opened.run("return document.querySelector('h1').textContent;") == ODD
    press("Tab", 9)
    press("Tab", 9)
    press("Enter", 13)
    opened.wait(f"location.pathname === '/' && {BEATING}")


@pytest.mark.parametrize("width", [360, 1280])
@pytest.mark.parametrize("path", ["", "valve?tag=FV-101"])
def test_wide_and_narrow_nothing_overlaps_or_is_cut_off(width, path, opened, page):
    opened.resize(width, 800)
    opened.open(page.url + path)
    opened.wait(BEATING)
    assert opened.run("return document.documentElement.scrollWidth;") == width
    assert opened.overlapping() == []
    assert errors(opened) == []
    assert opened.printed().startswith(b"%PDF")


@pytest.mark.slow
def test_a_valve_is_drawn_as_it_moves_and_an_alarm_comes_by_itself(opened, page, shown):
    shown.put(valve("FV-102"))
    opened.wait("document.body.innerText.includes('FV-102')")
    opened.open(f"{page.url}valve?tag=FV-102")
    position, loop = FIGURE.format("position"), FIGURE.format("force")
    opened.wait(f"{BEATING} && {position}.renderers[0].data_source.get_length() > 300")
    before = opened.run(f"return {position}.renderers[0].data_source.get_length();")
    opened.wait(f"{position}.renderers[0].data_source.get_length() > {before}")
    drawn = opened.run(f"return [...{position}.renderers[0].data_source.get('position')];")
    assert 10.0 < min(drawn) < max(drawn) < 28.0
    forces = opened.run(f"return [...{loop}.renderers[0].data_source.get('force')];")
    assert min(forces) > 1000.0
    assert "None so far." in opened.run("return document.getElementById('events').innerText;")
    shown.put(alarmed("FV-102"))
    opened.wait("document.querySelector('#head .badge b')?.textContent === 'M'")
    opened.wait("document.body.innerText.includes('packing: too tight, dry or worn')")  # the page is drawn part by part
    text = opened.run("return document.body.innerText;")
    assert "The friction has changed." in text
    assert "packing: too tight, dry or worn" in text
    opened.wait("!document.getElementById('events').innerText.includes('None so far.')")
    assert "test 'fc' at 2.5, limit 1" in opened.run("return document.getElementById('events').innerText;")
    assert "240 to 263" in opened.run("return document.getElementById('figures').innerText;")
    assert errors(opened) == []


def test_a_recording_is_shown_when_it_is_chosen_and_no_other_file_can_be(opened, page):
    opened.open(f"{page.url}valve?tag=FV-101")
    opened.wait(BEATING)
    offered = "return [...document.querySelectorAll('#recording option')].map(o => o.value);"
    assert opened.run(offered) == ["", "FV-101-20261123T080000Z-001.h5"]
    choose = """
        const choice = Bokeh.documents[0].get_model_by_name("choice");
        choice.data = { file: [arguments[0]] };
    """
    for other in ("../../../../etc/passwd", "FV-101-B-20261123T080000Z-001.h5", "", 7):
        opened.run(choose, other)
    opened.run("""
        const select = document.getElementById("recording");
        select.value = select.options[1].value;
        select.dispatchEvent(new Event("change", { bubbles: true }));
    """)
    history = f"{FIGURE.format('recorded')}.renderers[0].data_source"
    opened.wait(f"{history}.get_length() > 100")
    assert max(opened.run(f"return [...{history}.get('position')];")) == pytest.approx(30.0, abs=0.1)
    opened.wait("document.getElementById('history').innerText.includes('From 2026-11-23 08:00:00')")


def test_a_valve_that_there_is_not_is_said(opened, page):
    opened.open(f"{page.url}valve?tag=%3Cscript%3Ealert(1)%3C/script%3E")
    opened.wait(BEATING)
    assert "There is no valve of this name" in opened.run("return document.body.innerText;")
    assert opened.run("return document.querySelector('h1').textContent;") == "<script>alert(1)</script>"


@pytest.mark.slow
def test_when_the_data_of_a_valve_stop_it_says_so_and_when_a_task_stops(opened, shown):
    usual = shown.valves["LC74_20"]
    said = "[...document.querySelectorAll('li')].find(li => li.innerText.includes('LC74_20')).innerText"
    shown.put(replace(usual, link=link(connected=False, age_s=3.2), latest={}))
    opened.wait(f"/No data for 3\\ss: the link is down/.test({said})")
    shown.put(replace(usual, link=link(age_s=2.9), latest={}))
    opened.wait(f"/No data for 3\\ss: no good value comes/.test({said})")
    shown.put(usual)
    opened.wait(f"!/No data/.test({said})")
    shown.tasks.append(TaskStatus("recording", False, 3, "OSError: No space left on device", 0))
    opened.wait("/The task 'recording' does not run .*No space left/.test(document.body.innerText)")
    shown.tasks.pop()
    opened.wait("!/does not run/.test(document.body.innerText)")
    assert "No data" not in opened.run(f"return {said};")
    assert errors(opened) == []


WATCHED = """
    window.said = [];
    new MutationObserver(() => window.said.push(document.getElementById("alarm").textContent))
        .observe(document.getElementById("alarm"), { childList: true, characterData: true, subtree: true });
"""


def process_of(page: Page) -> int:
    """The process that serves the page."""
    assert page.process is not None
    return page.process


def test_the_monitor_that_is_gone_is_said_within_two_seconds_and_the_page_comes_back(opened, page):
    opened.run(WATCHED)
    os.kill(process_of(page), signal.SIGSTOP)
    try:
        opened.wait("window.said.length > 1 && !document.getElementById('alarm').hidden")
        first = opened.run("return window.said[0];")
        assert first in [f"No data for {n} s: the monitor does not answer. The values are old." for n in (1, 2)]
    finally:
        os.kill(process_of(page), signal.SIGCONT)
    opened.wait(f"document.getElementById('alarm').hidden && {BEATING}")
    assert len(opened.run(TAGS)) >= 5


@pytest.mark.slow
def test_a_page_that_was_killed_begins_anew_under_its_address_and_the_browser_finds_it(opened, page):
    opened.run("window.old = true;")
    killed = process_of(page)
    os.kill(killed, signal.SIGKILL)
    opened.wait("!document.getElementById('alarm').hidden")
    opened.wait(f"!window.old && document.getElementById('alarm').hidden && {BEATING}")
    assert process_of(page) != killed
