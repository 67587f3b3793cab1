"""What commands that read a plant share: which valves their options mean."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from recordings import BUNDLED, BadInput, file_of

if TYPE_CHECKING:  # whoever shows a recording needs no wire
    from hil import Valve

REPLAY = "replay:"


def located(address: str) -> str:
    """The address of a source, with ``replay:bundled:NAME`` as the file it means. Raises BadInput for no such name."""
    if not address.startswith(REPLAY + BUNDLED):
        return address
    place, mark, options = address.removeprefix(REPLAY).partition("?")
    return f"{REPLAY}{file_of(place)}{mark}{options}"


def shown_file(name: str) -> Path:
    """The file that a path, ``bundled:NAME`` or the name of a shipped map means. A file comes before a name."""
    path = file_of(name)
    if path.exists():
        return path
    from hil import map_file, map_names

    return map_file(name) if name in map_names() else path


def valves_from(map_: str, unit: str | None, names: str | None) -> Sequence[Valve]:
    """The valves of a map, one for each device id of ``1,2,5-7``, with names from ``A,B,C``. Raises BadInput."""
    from hil import RegisterMap, valves_of

    return valves_of(RegisterMap.load(map_), _units(unit), names.split(",") if names else ())


def _units(text: str | None) -> tuple[int, ...]:
    """Device ids from ``1,2,5-7``."""
    units: list[int] = []
    for part in text.split(",") if text is not None else ():
        first, dash, last = (word.strip() for word in part.partition("-"))
        if not first.isdecimal() or (dash and not last.isdecimal()):
            raise BadInput("--unit", f"'{text}' is not a list of device ids", "write for example 1,2,5-7")
        lowest, highest = int(first), int(last if dash else first)
        if not 1 <= lowest <= highest <= 247:
            found = f"'{part.strip()}' is no device id from 1 to 247, and no range of them"
            raise BadInput("--unit", found, "write for example 1,2,5-7")
        units += range(lowest, highest + 1)
    return tuple(units)
