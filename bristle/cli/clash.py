"""A package of another maker that has the name of one of ours."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

ROOMS = ("recordings", "simulator", "identification", "detector", "hil")
"""Our packages beside `bristle`; such names others may have, too."""


def clash() -> str | None:
    """What is wrong where Python finds another package or module under one of our names, in one line."""
    import bristle

    home = Path(bristle.__path__[0]).resolve().parent
    for name in ROOMS:
        try:
            spec = find_spec(name)
        except (ImportError, ValueError):
            spec = None
        places = [*(spec.submodule_search_locations or ()), spec.origin] if spec else []
        found = next((place for place in places if place), None)
        if found is None or Path(found).resolve() != home / name:
            where = f"is {found}" if found else "is not there"
            remedy = "remove or rename it, or use an environment without it" if found else "install Bristle again"
            return f"the package '{name}' {where}, not Bristle's in {home / name}; {remedy}"
    return None
