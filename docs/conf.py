"""How Sphinx builds this site: without a network, with every warning an error (`make docs`)."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

project = "Bristle"
author = "The Bristle developers"
copyright = author
release = version = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]["version"]

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode", "numpydoc"]
exclude_patterns = ["_build"]

myst_enable_extensions = ["deflist", "fieldlist"]
myst_heading_anchors = 3

default_role = "code"  # `name` in a docstring is code, as it is in Markdown
add_module_names = False
autodoc_member_order = "groupwise"
autodoc_default_options = {"members": True, "show-inheritance": False}
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

# Names of other libraries have no page here, and the site is built without a network.
nitpicky = True
nitpick_ignore_regex = [("py:.*", ".*")]

html_theme = "pydata_sphinx_theme"
html_title = f"Bristle {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "navbar_align": "left",
    "header_links_before_dropdown": 7,
    "footer_start": ["copyright"],
    "footer_end": ["sphinx-version"],
    "pygments_light_style": "tango",
    "pygments_dark_style": "monokai",
}


def plain(_app: Sphinx, _what: str, _name: str, _obj: object, _options: object, lines: list[str]) -> None:
    """Docstrings are read as text, too: what reStructuredText would take for a mark is escaped for it."""
    for i, line in enumerate(lines):
        lines[i] = re.sub(r"(?<=\w`)(?=\w)", r"\\ ", line).replace("|", r"\|")


def setup(app: Sphinx) -> None:
    """Tables of values are shown as they are."""
    app.add_lexer("csv", TextLexer)
    app.connect("autodoc-process-docstring", plain)
