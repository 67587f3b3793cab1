"""What a terminal may be sent of texts that come from files and devices."""

from __future__ import annotations


def plain_text(text: str) -> str:
    """A text as a terminal can show it: control characters, which could command it, are written as escapes.

    >>> plain_text("valve" + chr(27)) == "valve" + chr(92) + "x1b"
    True
    """
    return "".join(one if one in "\n\t" or one.isprintable() else repr(one)[1:-1] for one in text)
