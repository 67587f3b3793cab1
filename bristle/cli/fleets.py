"""What `bristle fleet` says, and what it needs besides the core."""

from __future__ import annotations

import importlib.util
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from recordings import not_installed

LIBRARIES = ("distributed", "fsspec", "pyarrow", "cryptography")


def needed() -> None:
    """Raises BadInput when a library of the extra is not there."""
    for name in LIBRARIES:
        if importlib.util.find_spec(name) is None:
            raise not_installed("fleet", "it", name, "fleet")


def told(row: Mapping[str, Any]) -> str:
    """A result in a line."""
    state = "" if row["state"] == "done" else f"{row['state']}: "
    date = f" ({row['date']})" if row["date"] else ""
    return f"{row['valve']}{date}: {state}{row['sentence']}"


def summary(rows: Sequence[Mapping[str, Any]]) -> str:
    """How many results there are, by state."""
    states = Counter(str(row["state"]) for row in rows)
    return f"{len(rows)} recording sets: " + ", ".join(f"{count} {state}" for state, count in sorted(states.items()))
