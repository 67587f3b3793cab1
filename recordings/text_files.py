"""Small text files that people and programs write, JSON and TOML, with limits before anything is built of them."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from recordings.atomic_files import check_regular
from recordings.errors import BadInput

LARGEST_BYTES = 16_000_000
DEEPEST = 64
"""Brackets inside brackets; what this program writes has seven."""

_STRING = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'')


def read_small_text(path: Path, remedy: str, largest: int = LARGEST_BYTES) -> str:
    """The text of a file in UTF-8, with or without a byte-order mark.

    remedy : what to give instead; largest : bytes. Raises BadInput: missing, no file, empty, larger, or not UTF-8.
    """
    check_regular(path)
    try:
        if path.stat().st_size > largest:
            raise BadInput(str(path), f"it is larger than {largest // 1_000_000} MB", remedy)
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise BadInput(str(path), "it is not text in UTF-8", remedy) from None
    except OSError as error:
        raise BadInput(str(path), f"it cannot be read ({error.strerror})", remedy) from None


def read_small_json(path: Path, remedy: str, largest: int = LARGEST_BYTES) -> Any:
    """The content of a JSON file. Raises BadInput as `read_small_text`, for what is no JSON, and for what is nested
    more than `DEEPEST` times.
    """
    return _parsed(path, read_small_text(path, remedy, largest), json.loads, "JSON", remedy)


def read_small_toml(path: Path, remedy: str, largest: int = LARGEST_BYTES) -> dict[str, Any]:
    """The same of a TOML file."""
    content: dict[str, Any] = _parsed(path, read_small_text(path, remedy, largest), tomllib.loads, "TOML", remedy)
    return content


def check_depth(path: Path, text: str, remedy: str) -> None:
    """Refuse brackets inside brackets that would exhaust the stack of a parser."""
    depth = deepest = 0
    for sign in re.findall(r"[][{}]", _STRING.sub("", text)):
        depth += 1 if sign in "[{" else -1
        deepest = max(deepest, depth)
    if deepest > DEEPEST:
        raise BadInput(str(path), f"its brackets are nested {deepest} times", remedy)


def _parsed(path: Path, text: str, parse: Callable[[str], Any], kind: str, remedy: str) -> Any:
    check_depth(path, text, remedy)
    try:
        return parse(text)
    except (ValueError, RecursionError) as error:  # also numbers of thousands of digits, and keys of a thousand parts
        words = " ".join(str(error).split())[:150]
        raise BadInput(str(path), f"it is not {kind} ({words})", remedy) from None
