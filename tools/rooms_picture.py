"""Draw the picture of the rooms and the arrows between them, from the same table that the import test checks.

Run from the repository: python -m tools.rooms_picture
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "rooms.svg"
WIDTH, HEIGHT = 150, 64
"""Size of a room in the picture."""
ROOMS: dict[str, tuple[int, int, str]] = {
    "bristle": (305, 20, "How is it used?"),
    "hil": (305, 120, "What goes over the wire?"),
    "identification": (120, 220, "What does a recording teach?"),
    "detector": (490, 220, "What has changed?"),
    "simulator": (305, 320, "What is the plant?"),
    "recordings": (305, 420, "What was measured?"),
}
"""Place of each room and the question that it answers."""
ARROWS = (
    ("bristle", "hil"),
    ("hil", "identification"),
    ("hil", "detector"),
    ("identification", "simulator"),
    ("detector", "simulator"),
    ("simulator", "recordings"),
)
"""From each room to the next ones below it; what is reached through them may be imported, too."""
LINE, FILL, INK = "#7d8590", "#dce9f7", "#15293e"
"""Colours that are readable on a light and on a dark ground."""


def svg() -> str:
    """The picture as text."""
    return "\n".join([
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 790 504" role="img" font-family="sans-serif">',
        "<title>Rooms of the house and what each may import</title>",
        f'<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="9" markerHeight="9" orient="auto">'
        f'<path d="M0 0L10 5L0 10z" fill="{LINE}"/></marker></defs>',
        *(_arrow(*pair) for pair in ARROWS),
        *(line for name in ROOMS for line in _room(name)),
        "</svg>\n",
    ])  # fmt: skip


def _room(name: str) -> Iterator[str]:
    x, y, question = ROOMS[name]
    left, width, middle = x - 15, WIDTH + 30, x + WIDTH // 2
    yield f'<rect x="{left}" y="{y}" width="{width}" height="{HEIGHT}" rx="8" fill="{FILL}" stroke="{LINE}"/>'
    style = f'text-anchor="middle" fill="{INK}"'
    yield f'<text x="{middle}" y="{y + 28}" font-size="17" font-weight="600" {style}>{name}/</text>'
    yield f'<text x="{middle}" y="{y + 49}" font-size="12" {style}>{question}</text>'


def _arrow(first: str, second: str) -> str:
    (x, y, _), (to_x, to_y, _) = ROOMS[first], ROOMS[second]
    lean = (to_x > x) - (to_x < x)
    start, end = x + WIDTH // 2 + 50 * lean, to_x + WIDTH // 2 - 50 * lean
    return (
        f'<line x1="{start}" y1="{y + HEIGHT}" x2="{end}" y2="{to_y - 2}" '
        f'stroke="{LINE}" stroke-width="2" marker-end="url(#tip)"/>'
    )


def main() -> None:
    """Write docs/rooms.svg."""
    PICTURE.write_text(svg(), encoding="utf-8")


if __name__ == "__main__":
    main()
