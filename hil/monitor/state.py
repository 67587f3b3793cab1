"""What a monitor has learned, as a file: written whole or not at all, and taken up again at the next start."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from detector import Watch, WatchState
from hil.monitor.valve import ValveWatch
from recordings import BadInput, save_text

FORMAT, VERSION = "monitor-state", 1


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
        raise BadInput(str(path), "it is a directory", "name a file for --state")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise BadInput(str(path), f"nothing can be written to the folder {path.parent}", "give another --state")


def load_state(path: Path, model_key: str) -> Mapping[str, tuple[Watch, WatchState]]:
    """What a file knows of valves by name. Raises BadInput when it cannot be used, or belongs to another model."""
    remedy = "learn anew (--learn), or give another --state"
    try:
        parts: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise BadInput(str(path), f"it cannot be read ({error})", remedy) from None
    if not isinstance(parts, dict) or (parts.get("format"), parts.get("version")) != (FORMAT, VERSION):
        raise BadInput(str(path), f"it is no {FORMAT} of version {VERSION}", remedy)
    if parts.get("model") != model_key:
        raise BadInput(str(path), "it was learned with another model", remedy)
    if not isinstance(parts.get("valves"), dict):
        raise BadInput(str(path), "it names no valves", remedy)
    found = {}
    for name, one in parts["valves"].items():
        try:
            watch = Watch.from_dict(one["watch"])
            found[name] = (watch, watch.state_from_dict(one["state"]))
        except BadInput as problem:
            raise BadInput(f"{path}: {name}: {problem.where}", problem.found, remedy) from None
        except (KeyError, TypeError) as error:
            raise BadInput(f"{path}: {name}", f"it cannot be read ({error!r})", remedy) from None
    return found
