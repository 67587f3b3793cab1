"""Reading register maps: TOML and CSV into values, and every mistake into one line that names its place."""

from __future__ import annotations

import csv
import difflib
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from hil.registers.point import Point
from recordings import BadInput, read_small_text, read_small_toml

MAPS = Path(__file__).parent / "maps"
LARGEST_FILE = 4_000_000

Map = TypeVar("Map", bound=BaseModel)
_ADVICE = {
    "missing": "give it",
    "literal_error": "use one of the allowed words",
    "too_short": "add at least one",
}


def shipped() -> tuple[str, ...]:
    """Names of the maps that come with the program."""
    return tuple(sorted(path.stem for path in MAPS.glob("*.toml")))


def locate(source: str | Path) -> Path:
    """The file that a path or the name of a shipped map means. Raises BadInput when there is neither."""
    path = Path(source)
    if path.is_file():
        return path
    if str(source) in shipped():
        return MAPS / f"{source}.toml"
    if path.is_dir():
        raise BadInput(str(source), "this is a folder", "give a register map file (.toml or .csv)")
    raise BadInput(str(source), "there is no such file", f"give a path, or a shipped map: {', '.join(shipped())}")


def read_map(model: type[Map], source: str | Path) -> Map:
    """A map of one kind from a TOML or CSV file or by shipped name. Raises BadInput."""
    path = locate(source)
    return validated(model, read_csv(path) if path.suffix == ".csv" else read_toml(path), str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a TOML file. Raises BadInput with the line and column of a mistake."""
    return read_small_toml(path, "correct it, or see docs/register-maps.md", LARGEST_FILE)


def read_csv(path: Path) -> dict[str, Any]:
    """A table of points as the content of a map; numbers may be written 0x8000. Raises BadInput naming the row."""
    text = read_small_text(path, "give a register map file (.toml or .csv)", LARGEST_FILE)
    first = text.split("\n", 1)[0]
    rows = csv.DictReader(io.StringIO(text), delimiter=max(",;\t", key=first.count), skipinitialspace=True, strict=True)
    try:
        _check_columns(path, rows.fieldnames or ())
        return {"name": path.stem, "points": [_row(path, rows.line_num, row) for row in rows]}
    except csv.Error as error:
        where = f"{path}: line {rows.line_num}"
        raise BadInput(where, f"not CSV: {error}", "write one point per line, as in the header") from None


def _check_columns(path: Path, names: Sequence[str]) -> None:
    columns = {*Point.model_fields, "valid_min", "valid_max"} - {"valid_range"}
    for k, name in enumerate(names):
        if name not in columns:
            raise BadInput(f"{path}: column {name!r}", "this column is not known", _choice(name, columns))
        if name in names[:k]:
            raise BadInput(f"{path}: column {name!r}", "it is there twice", "keep the right one")


def validated(model: type[Map], content: Mapping[str, Any], where: str) -> Map:
    """The content as a map. Raises BadInput for the first thing that is wrong, saying how many more there are."""
    _refuse_other_kind(model, content, where)
    try:
        return model.model_validate(content)
    except ValidationError as error:
        # A list whose only entry is wrong is also reported as too short: that is not a second mistake.
        found = [e for e in error.errors() if e["type"] != "too_short"] or error.errors()
        raise _bad_input(model, found[0], len(found) - 1, content, where) from None


def _row(path: Path, line: int, row: Mapping[str | None, Any]) -> dict[str, Any]:
    """One CSV row as the keys of a point; cells are text, and a cell that should be a number and is not stays text."""
    if None in row:
        raise BadInput(f"{path}: line {line}", "more cells than the header has columns", "one cell per column")
    cells = {str(name): cell.strip() for name, cell in row.items() if cell and cell.strip()}
    words = {"name", "table", "type", "byte_order", "unit", "description"}
    point: dict[str, Any] = {name: cell if name in words else _number(cell) for name, cell in cells.items()}
    if "invalid" in cells:
        point["invalid"] = [_number(part) for part in cells["invalid"].split()]
    limits = [point.pop(name, None) for name in ("valid_min", "valid_max")]
    if limits != [None, None]:
        open_ended = (float("-inf"), float("inf"))
        point["valid_range"] = [end if limit is None else limit for limit, end in zip(limits, open_ended, strict=True)]
    return point


def _number(cell: str) -> int | float | str:
    """A number, where the cell is one that people write: no underscores, and no digits but 0 to 9."""
    for kind in (lambda text: int(text, 0), float) if cell.isascii() and "_" not in cell else ():
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell


def _refuse_other_kind(model: type[Map], content: Mapping[str, Any], where: str) -> None:
    kinds = {"read": "a map for reading (kind = 'read')", "write": "a map for writing (kind = 'write')"}
    own = "read" if model.model_fields["kind"].default == "read" else "write"
    kind = content.get("kind", "read")
    if not isinstance(kind, str) or kind not in kinds:
        raise BadInput(f"{where}: kind", f"{kind!r} is not a kind of map", "use 'read' or 'write'")
    if kind != own:
        raise BadInput(where, f"this is {kinds[kind]}", f"{kinds[own]} is needed here")


def _bad_input(
    model: type[BaseModel], error: ErrorDetails, more: int, content: Mapping[str, Any], where: str
) -> BadInput:
    """A pydantic error in our words."""
    place, text = _place(error, content), str(error["msg"]).removeprefix("Value error, ")
    if error["type"] == "extra_forbidden":
        inside = Point if error["loc"][0] == "points" else model if len(error["loc"]) == 1 else None
        key = str(error["loc"][-1])
        remedy = _choice(key, set(inside.model_fields)) if inside else "remove it"
        return BadInput(f"{where}: {place}", "unknown key", _counted(remedy, more))
    if error["type"] == "value_error" and ";" in text:
        text, _, remedy = text.partition("; ")
    else:
        remedy = _ADVICE.get(error["type"], "correct it; docs/register-maps.md has every key")
    shown = "" if error["type"] in {"missing", "value_error"} else f" (found {error['input']!r:.60})"
    own_place = text.split(":", 1)[0] if error["type"] == "value_error" and not error["loc"] else ""
    found = text[len(own_place) + 2 :] if own_place else text
    return BadInput(f"{where}: {own_place or place}", f"{found}{shown}", _counted(remedy, more))


def _place(error: ErrorDetails, content: Mapping[str, Any]) -> str:
    """Where in the file: ``points[3].adress``, with the point's name once it is known."""
    parts = [f"[{step}]" if isinstance(step, int) else f".{step}" for step in error["loc"]]
    place = "".join(parts).lstrip(".")
    if len(error["loc"]) >= 2 and error["loc"][0] == "points" and isinstance(error["loc"][1], int):
        point = content["points"][error["loc"][1]]
        if isinstance(point, Mapping) and isinstance(point.get("name"), str):
            place += f" ({point['name']!r})"
    return place or "map"


def _choice(word: str, allowed: set[str]) -> str:
    close = difflib.get_close_matches(word, sorted(allowed), n=1, cutoff=0.6)
    return f"did you mean {close[0]!r}?" if close else f"allowed are {', '.join(sorted(allowed))}"


def _counted(remedy: str, more: int) -> str:
    return remedy if not more else f"{remedy} (and {more} more mistake{'s' if more > 1 else ''})"
