"""What a monitor has learned, as a file: written whole or not at all, to resume from at the next start."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from detector import Watch, WatchState
from hil.monitor.valve import ValveWatch
from recordings import BadInput, read_small_json, save_text
from simulator import CATALOGUE, Catalogue

FORMAT, VERSION = "monitor-state", 3
LARGEST_FILE = 64_000_000
LARGEST = 1e15
"""Numbers beyond it are no limits, levels or states of a valve: a detector with one would never raise an alarm."""


def save_state(path: Path, valves: Sequence[ValveWatch], model_key: str) -> None:
    """Write what is learned of the valves. model_key : names the model it was learned with. Raises BadInput."""
    known = {
        one.valve: {"watch": one.watch.as_dict(), "state": one.state.as_dict()}
        for one in valves
        if one.watch is not None and one.state is not None
    }
    about = {"format": FORMAT, "version": VERSION, "model": model_key, "sha256": _checksum(known)}
    save_text(path, json.dumps(about | {"valves": known}) + "\n")


def check_state(path: Path) -> None:
    """Raise BadInput when nothing can be saved there: better now than when hours have been learned from."""
    if path.is_dir():
        raise BadInput(str(path), "it is a directory", "name a file", parameter="state")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        found = f"nothing can be written to the folder {path.parent}"
        raise BadInput(str(path), found, "give another file", parameter="state")


def load_state(path: Path, model_key: str, catalogue: Catalogue = CATALOGUE) -> Mapping[str, tuple[Watch, WatchState]]:
    """What a file knows of valves by name. catalogue : where the model's effects are looked up.

    Raises BadInput when the file cannot be used, or belongs to another model.
    """
    found = {}
    for name, one in _valves(path, model_key).items():
        try:
            watch = Watch.from_dict(one["watch"], catalogue)
            found[name] = (watch, watch.state_from_dict(one["state"]))
        except BadInput as problem:
            raise _unusable(f"{path}: {name}: {problem.where}", problem.found) from None
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            raise _unusable(f"{path}: {name}", f"it cannot be read ({error!r})") from None
    return found


def _valves(path: Path, model_key: str) -> dict[str, Any]:
    """What a state file holds, by the name of the valve, once it is known to be whole and of this model."""
    try:
        parts = read_small_json(path, "", LARGEST_FILE)
    except BadInput as problem:
        raise _unusable(path, f"it cannot be read: {problem.found}") from None
    if not isinstance(parts, dict) or parts.get("format") != FORMAT:
        raise _unusable(path, f"it is no {FORMAT}")
    if parts.get("version") != VERSION:
        raise _unusable(path, f"it is of version {parts.get('version')}, and this release reads version {VERSION}")
    if parts.get("model") != model_key:
        raise _unusable(path, "it was learned with another model")
    if not isinstance(parts.get("valves"), dict):
        raise _unusable(path, "it names no valves")
    if parts.get("sha256") != _checksum(parts["valves"]):
        raise _unusable(path, "its checksum is wrong: it was changed or damaged")
    if not _plausible(parts["valves"]):
        raise _unusable(path, f"it has numbers that are not finite, or beyond {LARGEST:g}")
    return dict(parts["valves"])


def _checksum(valves: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(valves, sort_keys=True).encode()).hexdigest()


def _plausible(parts: Any) -> bool:
    """Whether every number in it is finite and of a size that can be."""
    if isinstance(parts, dict):
        return all(map(_plausible, parts.values()))
    if isinstance(parts, list):
        return all(map(_plausible, parts))
    return not isinstance(parts, float | int) or (math.isfinite(parts) and abs(parts) <= LARGEST)


def _unusable(where: Path | str, found: str) -> BadInput:
    return BadInput(str(where), found, "learn anew, or give another file", parameter="state")
