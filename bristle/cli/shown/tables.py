"""Register maps, mappings of an import, and plant files: what people write."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from bristle.cli.output.tables import width
from recordings import BadInput


def map_words(file: Path) -> str:
    """A register map as a table."""
    from hil import describe_register_map

    return describe_register_map(file, width())


def map_picture(file: Path) -> str:
    """The same as a page."""
    from hil import register_map_page

    return register_map_page(file)


def mapping_words(file: Path) -> str:
    """A mapping of an import, once it is known to be one."""
    from recordings.importers import load_mapping

    load_mapping(file)
    return "\n".join([f"{file}: a mapping for bristle import", *_outline(_read(file))])


def plant_words(file: Path) -> str:
    """A plant file, as it is written. `bristle monitor --check` says what would be done with it."""
    return "\n".join([f"{file}: a plant file for bristle monitor --plant", *_outline(_read(file))])


def toml_facts(file: Path) -> Mapping[str, Any]:
    """What stands in the file."""
    return _read(file)


def is_map_table(file: Path) -> bool:
    """Whether a CSV file is a register map: its header has the keys of a point."""
    try:
        with file.open(encoding="utf-8-sig", errors="replace") as lines:
            head = {word.strip() for word in lines.readline(4000).replace(";", ",").replace("\t", ",").split(",")}
    except OSError:
        return False
    return {"name", "table", "address"} <= head


def _read(file: Path) -> dict[str, Any]:
    if file.suffix.lower() == ".csv":
        from hil import RegisterMap

        return RegisterMap.load(file).model_dump(mode="json")
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(str(file), f"it is no TOML ({error})", "correct the line") from None


def _outline(content: Mapping[str, Any], indent: str = "  ") -> Iterator[str]:
    """Keys and values, sections indented."""
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield f"{indent}{name}"
            yield from _outline(value, f"{indent}  ")
        elif isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
            for number, one in enumerate(value, 1):
                yield f"{indent}{name} {number}"
                yield from _outline(one, f"{indent}  ")
        else:
            yield f"{indent}{name} = {value if isinstance(value, str) else json.dumps(value, default=str)}"
