"""The page of a watched valve: it opens with verdict, confidence and next action, stays small, and prints on A4."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from _page import Page

from detector import Judgement, SampleVerdict, WatchCourse, Watched, WatchedValve, watch_page

QUIET = Judgement(0.0, False, False, False, False, None, "spring", 0.2, 1.0, 0.2, SampleVerdict.USED)
LEARNED = "false alarms: 80 s fault-free support at most one in 22 hours"


def judged(n: int, alarm_at: int | None = None, cleared_at: int | None = None, kind: str | None = None):
    """Judgements ten times a second, with an alarm that may end again."""
    for k in range(n):
        on = alarm_at is not None and alarm_at <= k and (cleared_at is None or k < cleared_at)
        began, ended = k == alarm_at, k == cleared_at
        load = 1.6 if on else 0.2
        yield replace(QUIET, time_s=0.1 * k, alarm=on, began=began, ended=ended, kind=kind if on else None, load=load)


def page(*judgements: Judgement) -> str:
    return watch_page([WatchedValve("LC74_20", LEARNED, WatchCourse.of(judgements))])


@pytest.mark.parametrize(
    ("judgements", "word", "action"),
    [
        (judged(50), "Good: nothing was above its limit in 50 samples", "nothing; watch on"),
        (judged(50, 20, None, "friction"), "Repair: the friction has changed", "check on site: packing"),
        (judged(50, 20, None, "supply"), "Watch: the supply pressure is not usual", "check on site: air supply"),
        (judged(50, 20, None, None), "Watch: the valve moves unlike it was learned", "check on site: positioner"),
        (judged(50, 20, 30, "friction"), "Watch: there was an alarm once", "see whether it comes again"),
        ((), "Watch: nothing was judged", "let the valve move"),
    ],
)
def test_the_page_opens_with_tag_date_verdict_confidence_and_action(judgements, word, action):
    said = page(*judgements)
    read = Page(said)
    words = read.sections[""]
    assert words.index("Valve LC74_20: watched") < words.index("Report of 20") < words.index("Verdict:")
    assert word in words
    assert LEARNED in words
    assert f"Next: {action}" in words
    assert not [address for address in read.addresses if address.startswith(("http", "//"))]


def test_a_year_of_judgements_stays_small_and_loses_no_peak():
    course = WatchCourse(most=100)
    for k, one in enumerate(judged(100_000, 70_000, 70_001, "spring")):
        course.add(one if k else replace(one, load=0.9))
    assert len(course.time_s) <= 100
    assert course.samples == course.used == 100_000
    assert course.load.max() == 1.6
    assert course.load[0] == 0.9
    assert int(np.sum(course.alarm)) == 1
    at = course.time_s[course.alarm][0]
    assert at <= 7000.0 < at + 10_000.0 / 50
    assert [one.began for one in course.changes] == [True, False]


def test_texts_of_tags_are_no_html():
    assert "<b>x" not in watch_page([WatchedValve("<b>x", "<i>y", WatchCourse.of(judged(3)))])


@pytest.mark.browser
def test_the_page_prints_on_a4_with_nothing_cut(browser, tmp_path):
    Watched(tuple(judged(300, 100, None, "friction")), "LC74_20", LEARNED).report(tmp_path / "page.html")
    assert browser.lost_on_a4(tmp_path / "page.html") == []
