"""How Sphinx builds this site: without a network, with every warning an error (`make docs`)."""

from __future__ import annotations

import re
import sys
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


FIELD = re.compile(r"^(?P<names>[a-z_]\w*(, [a-z_]\w*)*) : (?P<text>.+)$")
"""A line of a docstring that says what an attribute is."""


def written_for_sphinx(_app: Sphinx, _what: str, _name: str, _obj: object, _options: object, lines: list[str]) -> None:
    """Docstrings are read as text, too. Their lists of attributes, examples and signs are marked for Sphinx here."""
    if "-----" in "".join(lines):
        _with_heading_of_examples(lines)
    else:
        lines[:] = _with_lists(lines)
    for i, line in enumerate(lines):
        lines[i] = re.sub(r"(?<=\w`)(?=\w)", r"\\ ", line).replace("|", r"\|")


def _with_heading_of_examples(lines: list[str]) -> None:
    """An example that follows the sections of a docstring is a section of its own."""
    first = next((i for i, line in enumerate(lines) if line.startswith(">>>")), None)
    if first is not None and "Examples" not in lines:
        lines[first:first] = ["Examples", "--------"]


def _with_lists(lines: list[str]) -> list[str]:
    """Lines such as ``gain : fall of the cost`` become a list, with what continues them."""
    made, within = list[str](), False
    for i, line in enumerate(lines):
        field = FIELD.match(line)
        if field and (within or i == 0 or not lines[i - 1]):
            names = ", ".join(f"`{name}`" for name in field["names"].split(", "))
            made += [f"- {names}: {field['text']}"]
            within = True
        elif within and line.startswith("    "):
            made.append(line[2:])
        else:
            made += [""] if within and line else []
            made.append(line)
            within = False
    return made


def only_its_own(app: Sphinx, what: str, _name: str, obj: object, _skip: bool, _options: object) -> bool | None:
    """What the Python door takes from the rooms is described there."""
    at_the_door = what == "module" and app.env.current_document.docname == "reference/bristle"
    return True if at_the_door and not str(getattr(obj, "__module__", "")).startswith("bristle") else None


def draw_models(_app: Sphinx) -> None:
    """The pictures of docs/models are drawn by the models themselves."""
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from tools.gallery import write

    write()


def setup(app: Sphinx) -> None:
    """Tables of values are shown as they are, and models draw their pictures before pages are read."""
    app.add_lexer("csv", TextLexer)
    app.connect("autodoc-process-docstring", written_for_sphinx, priority=400)  # before numpydoc
    app.connect("autodoc-skip-member", only_its_own)
    app.connect("builder-inited", draw_models)
