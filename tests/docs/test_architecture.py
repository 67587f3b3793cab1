"""The picture of the rooms is drawn from the rules that imports are held to."""

from __future__ import annotations

from test_imports import ARROWS as RULES

from tools.rooms_picture import ARROWS, PICTURE, ROOMS, svg


def below(room: str) -> set[str]:
    """The rooms that arrows lead to from a room, directly or through others."""
    return {name for first, then in ARROWS if first == room for name in {then, *below(then)}}


def test_arrows_lead_to_the_rooms_that_a_room_may_import() -> None:
    assert {room: below(room) for room in ROOMS} == RULES


def test_the_picture_is_the_drawn_one() -> None:
    assert PICTURE.read_text(encoding="utf-8") == svg(), "the rooms changed: run python -m tools.rooms_picture"
