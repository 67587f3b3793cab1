"""The page of what a detector saw: verdict, confidence and next action, then picture and table for every valve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from detector.alarms.promise import words as lasting
from detector.page import dated, opening_html, whole_page
from detector.watch.advice import ADVICE
from detector.watch.course import WatchCourse
from detector.watch.pictures import picture, table
from recordings import ReportOpening


@dataclass(frozen=True)
class WatchedValve:
    """tag : of the valve, empty where none is known; learned : in words, how often a false alarm comes; course : what
    was seen.
    """

    tag: str
    learned: str
    course: WatchCourse


def watch_opening(valve: WatchedValve) -> ReportOpening:
    """What the page of a valve opens with."""
    course, sure = valve.course, valve.learned or "nothing was learned yet"
    last = course.last
    if last is None:
        return ReportOpening(
            "watch", "nothing was judged", sure, "let the valve move over its usual range, and watch on"
        )
    seen = f"{course.used} samples over {lasting(course.last_s - course.first_s)}"
    if not course.alarms and not last.alarm:
        return ReportOpening("good", f"nothing was above its limit in {seen}", sure, "nothing; watch on")
    began = [one for one in course.changes if one.began or one.renamed]
    kind = last.kind if last.alarm else began[-1].kind if began else None
    advice = ADVICE[kind]
    first = f"check on site: {advice.check[0]}"
    if last.alarm:
        score = f"largest score {last.load:.3g}, an alarm above 1; {sure}"
        return ReportOpening("repair" if advice.valve else "watch", advice.reason, score, first)
    times = "once" if course.alarms == 1 else f"{course.alarms} times"
    why = f"there was an alarm {times} in {seen}, and there is none any more; the last: {advice.reason}"
    return ReportOpening("watch", why, sure, f"see whether it comes again; {first}")


def watch_page(valves: Sequence[WatchedValve]) -> str:
    """The page of all valves that were watched, each with its opening."""
    from bokeh.embed import components

    plots = {f"p{k}": picture(valve.course) for k, valve in enumerate(valves)}
    script, places = components(plots) if plots else ("", {})
    body = "".join(_section(valve, places[f"p{k}"], len(valves) > 1) for k, valve in enumerate(valves))
    tags = ", ".join(valve.tag for valve in valves if valve.tag)
    title = f"Valve {tags}: watched" if tags else "A valve that was watched"
    return whole_page(title, f"{dated('What the detector saw.')}{body}", script)


def _section(valve: WatchedValve, plot: str, several: bool) -> str:
    heading = f"<h2>{escape(valve.tag)}</h2>" if several else ""
    course = valve.course
    alarms = "1 alarm" if course.alarms == 1 else f"{course.alarms} alarms"
    said = f"{course.samples} samples, {course.used} of them judged; {alarms}."
    shown = f"<div class='wide'>{table(course)}</div>" if course.changes else ""
    return f"{heading}{opening_html(watch_opening(valve))}<p class='note'>{said}</p>{plot}{shown}"
