"""What a section of the page is: a title, the words its template fills in, and its plots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Section:
    """One section. anchor : its place in the page; words : what the template fills in, escaped there; plots : bokeh
    models by name, which the template places as ``plots.<name>``; template : by name, that of the anchor if not given.
    """

    anchor: str
    title: str
    words: Mapping[str, Any] = field(default_factory=dict)
    plots: Mapping[str, Any] = field(default_factory=dict)
    template: str = ""
