"""The overview: all valves of the plant, the worst first, each with its state, why, and since when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from urllib.parse import quote

from bokeh.document import Document
from markupsafe import Markup

from hil.page.feed import Feed, Silence
from hil.page.views.live import LivePage
from hil.page.views.rendering import template
from hil.page.views.words import NOTHING, OUTLINES, lasting, measured, since
from hil.service.status import Health, PlantStatus, TaskStatus, ValveStatus

FIRST_SHOWN = ("position", "setpoint", "pressure", "force")
"""Signals that stand in the overview."""


@dataclass(frozen=True)
class Badge:
    """A state by letter, shape, colour and words: any one of them tells it."""

    letter: str
    colour: str
    outline: Markup
    words: str

    @classmethod
    def of(cls, health: Health) -> Badge:
        """The badge of a state."""
        return cls(health.letter, health.colour, Markup(OUTLINES[health]), health.value)


@dataclass(frozen=True)
class ValveLine:
    """A valve of the overview, in words."""

    tag: str
    link: str
    badge: Badge
    reason: str
    since: str
    check: str
    values: tuple[tuple[str, str], ...]
    load: float
    phase: str
    silence: str


def plant_document(feed: Feed, doc: Document) -> None:
    """Fill a document with the overview."""
    name = feed.status.plant if feed.status else "bristle"
    LivePage(feed, doc, "plant.html", f"{name}: valves", None, lambda: plant_pieces(feed))


def plant_pieces(feed: Feed) -> Mapping[str, str]:
    """What is shown now, by place."""
    status = feed.status
    if status is None:
        return {"head": "", "notices": "", "valves": "<p>The monitor has not said anything yet.</p>", "tasks": ""}
    lines = [line_of(one, feed, status.at) for one in worst_first(feed, status)]
    return {
        "head": template("plant_head.html").render(
            plant=status.plant, worst=Badge.of(status.health), counts=_counts(status)
        ),
        "notices": template("notices.html").render(notices=notices(feed, status)),
        "valves": template("valves.html").render(valves=lines),
        "tasks": template("tasks.html").render(n=len(status.tasks), troubled=_troubled(status)),
    }


def worst_first(feed: Feed, status: PlantStatus) -> list[ValveStatus]:
    """The valves as they are listed: by state, then those without data, then by tag."""
    return sorted(status.valves, key=lambda one: (-one.health.rank, feed.silence_of(one) is None, one.tag))


def line_of(valve: ValveStatus, feed: Feed, now: datetime) -> ValveLine:
    """What is said of a valve in the overview."""
    values = tuple(measured(name, valve.latest[name]) for name in FIRST_SHOWN if name in valve.latest)
    return ValveLine(
        valve.tag, f"/valve?tag={quote(valve.tag, safe='')}", Badge.of(valve.health), valve.reason,
        since(valve.since, now), "; ".join(valve.check), values, valve.load, valve.phase,
        silence_words(feed.silence_of(valve)),
    )  # fmt: skip


def silence_words(silence: Silence | None) -> str:
    """That no data come, for how long and why; nothing while they do."""
    if silence is None:
        return ""
    if silence.seconds == float("inf"):
        return f"No data yet: {silence.words}."
    return f"No data for {lasting(silence.seconds)}: {silence.words}."


def notices(feed: Feed, status: PlantStatus) -> list[str]:
    """What is wrong with the watching itself."""
    silence = feed.silence
    found = [] if silence is None else [silence_words(silence)]
    return found + [said for task in status.tasks if (said := _about(task))]


def _about(task: TaskStatus) -> str:
    if task.running:
        return ""
    if task.last_error:
        return f"The task '{task.name}' does not run ({task.last_error}). It is begun anew by itself."
    return f"The task '{task.name}' has ended."


def _troubled(status: PlantStatus) -> list[TaskStatus]:
    """Tasks of which more can be said than that they run."""
    return [task for task in status.tasks if not task.running or task.restarts or task.dropped]


def _counts(status: PlantStatus) -> str:
    """How many valves are in which state, the worst state first."""
    n: dict[Health, int] = dict.fromkeys(reversed(Health), 0)
    for valve in status.valves:
        n[valve.health] += 1
    said = ", ".join(f"{count} {health}" for health, count in n.items() if count)
    return f"{len(status.valves)} valve{'' if len(status.valves) == 1 else 's'}: {said or NOTHING}"
