"""The templates of the page: every text that comes from outside is escaped."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup

FOLDER = Path(__file__).with_name("templates")


@cache
def environment() -> Environment:
    """Where templates come from, with our own style and script."""
    made = Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.globals |= {"style": _asset("style.css"), "behaviour": _asset("page.js")}
    return made


def template(name: str) -> Template:
    """One of them by its name."""
    return environment().get_template(name)


def _asset(name: str) -> Markup:
    """Our own text, which goes in as it is."""
    return Markup((FOLDER / name).read_text(encoding="utf-8"))
