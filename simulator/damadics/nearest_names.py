"""What to say when a name does not exist."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def nearest(name: str, known: Iterable[str], most: int = 5) -> str:
    """The known names nearest to one that does not exist, for a message; all of them when they are few.

    >>> nearest("f4-incipent", ["f4-incipient", *(f"f{n}-abrupt-big" for n in range(1, 12))], most=1)
    'nearest names: f4-incipient'
    """
    names = list(known)
    if len(names) <= most:
        return f"there are {', '.join(names)}"
    close = difflib.get_close_matches(name, names, n=most, cutoff=0.3) or names[:most]
    return f"nearest names: {', '.join(close)}"
