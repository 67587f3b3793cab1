"""The picture of the rooms is drawn from the rules that imports are held to, every door has its reference, and
the page on tracing speaks of numbers that exist."""

from __future__ import annotations

import re
from pathlib import Path

from test_imports import ARROWS as RULES
from test_imports import DOORS

from tools.rooms_picture import ARROWS, PICTURE, ROOMS, svg

ROOT = Path(__file__).resolve().parents[2]


def below(room: str) -> set[str]:
    """The rooms that arrows lead to from a room, directly or through others."""
    return {name for first, then in ARROWS if first == room for name in {then, *below(then)}}


def test_arrows_lead_to_the_rooms_that_a_room_may_import() -> None:
    assert {room: below(room) for room in ROOMS} == RULES


def test_the_picture_is_the_drawn_one() -> None:
    assert PICTURE.read_text(encoding="utf-8") == svg(), "the rooms changed: run python -m tools.rooms_picture"


def test_every_door_has_its_reference() -> None:
    pages = (ROOT / "docs" / "reference").glob("*.md")
    listed = {name for page in pages for name in re.findall(r"automodule:: (\S+)", page.read_text(encoding="utf-8"))}
    assert listed == set(DOORS)


def test_the_numbers_of_the_method_are_those_of_the_settings() -> None:
    settings = ROOT / "identification" / "tracing" / "settings.py"
    text = (ROOT / "docs" / "tracing.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([A-Z][A-Z_]+)`", text))
    known = set(re.findall(r"^([A-Z][A-Z_]+)\b", settings.read_text(encoding="utf-8"), re.M))
    assert len(named) > 20
    assert len(known) <= 30
    assert named <= known
    assert len(text.splitlines()) <= 80
