"""The picture of the rooms is drawn from the rules that imports are held to, every door has its reference, and
the pages on tracing have the method as its module has it, and speak of numbers that exist."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from textwrap import dedent

from test_imports import ARROWS as RULES
from test_imports import DOORS

from identification.tracing import algorithm
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


def test_the_page_on_tracing_begins_with_the_method_as_its_module_has_it() -> None:
    page = (ROOT / "docs" / "tracing.md").read_text(encoding="utf-8")
    shown = page.split("```text\n")[1].split("```")[0]
    told = dedent("\n".join(inspect.getsource(algorithm).splitlines()[2:17])) + "\n"
    assert shown == told
    folder = ROOT / "identification" / "tracing"
    modules = re.findall(r"[\w/]+\.py", told)
    assert [m for m in modules if not ((folder / m).exists() or (folder.parent / m).exists())] == []


def test_the_numbers_of_the_method_are_those_of_the_settings() -> None:
    settings = ROOT / "identification" / "tracing" / "settings.py"
    method, special = ((ROOT / "docs" / f"{name}.md").read_text("utf-8") for name in ("tracing", "tracing-special"))
    named = set(re.findall(r"`([A-Z][A-Z_]+)`", method + special))
    known = set(re.findall(r"^([A-Z][A-Z_]+)\b", settings.read_text(encoding="utf-8"), re.M))
    assert len(named) > 20
    assert len(known) <= 30
    assert named <= known
    assert len(method.splitlines()) <= 80
