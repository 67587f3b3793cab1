"""The files of the demo, and room for them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from recordings import BadInput

KINDS: Mapping[str, tuple[str, ...]] = {
    "report": ("report.html", "trace.html"),
    "recordings": ("staircase.h5", "sines.h5", "held-out.h5"),
    "models": ("model.json", "traced.json"),
    "trace": ("trace.json",),
    "events": ("events.jsonl",),
}
"""What the demo leaves behind, by what it is."""


def cleared(out: Path) -> None:
    """Make the folder, and remove the files of an earlier demo. Raises BadInput when nothing can be written there."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(str(out), f"the folder cannot be made ({error.strerror})", "give another --out") from error
    for path in (out / name for names in KINDS.values() for name in names):
        try:
            path.unlink(missing_ok=True)
            path.touch()
            path.unlink()
        except OSError as error:
            raise BadInput(str(path), f"it cannot be written ({error.strerror})", "give another --out") from error
