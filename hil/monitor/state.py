"""What a monitor has learned, as a file: written whole or not at all, to resume from at the next start."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from detector import Watch, WatchState
from hil.monitor.valve import ValveWatch
from recordings import BadInput, save_text
from simulator import CATALOGUE, Catalogue

FORMAT, VERSION = "monitor-state", 2


def save_state(path: Path, valves: Sequence[ValveWatch], model_key: str) -> None:
    """Write what is learned of the valves. model_key : names the model it was learned with. Raises BadInput."""
    known = {
        one.valve: {"watch": one.watch.as_dict(), "state": one.state.as_dict()}
        for one in valves
        if one.watch is not None and one.state is not None
    }
    text = json.dumps({"format": FORMAT, "version": VERSION, "model": model_key, "valves": known})
    save_text(path, text + "\n")


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
    try:
        parts: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise _unusable(path, f"it cannot be read ({error})") from None
    if not isinstance(parts, dict) or parts.get("format") != FORMAT:
        raise _unusable(path, f"it is no {FORMAT}")
    if parts.get("version") != VERSION:
        raise _unusable(path, f"it is of version {parts.get('version')}, and this release reads version {VERSION}")
    if parts.get("model") != model_key:
        raise _unusable(path, "it was learned with another model")
    if not isinstance(parts.get("valves"), dict):
        raise _unusable(path, "it names no valves")
    found = {}
    for name, one in parts["valves"].items():
        try:
            watch = Watch.from_dict(one["watch"], catalogue)
            found[name] = (watch, watch.state_from_dict(one["state"]))
        except BadInput as problem:
            raise _unusable(f"{path}: {name}: {problem.where}", problem.found) from None
        except (KeyError, TypeError) as error:
            raise _unusable(f"{path}: {name}", f"it cannot be read ({error!r})") from None
    return found


def _unusable(where: Path | str, found: str) -> BadInput:
    return BadInput(str(where), found, "learn anew, or give another file", parameter="state")
