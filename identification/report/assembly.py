"""One self-contained page out of sections: templates filled in, bokeh's script inside, nothing to fetch."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from identification.report.section import Section
from recordings import ReportOpening, save_text

TEMPLATES = Environment(
    loader=PackageLoader("identification.report"), autoescape=True, undefined=StrictUndefined,
    trim_blocks=True, lstrip_blocks=True,
)  # fmt: skip


@dataclass(frozen=True)
class Front:
    """The top of a page. kind : what page it is; heading : of what plant; lines : below it; title : of the window;
    opening : verdict, confidence and next action.
    """

    kind: str
    heading: str
    lines: tuple[str, ...]
    title: str
    opening: ReportOpening


def assembled(front: Front, sections: Sequence[Section]) -> str:
    """The page as HTML. It needs no network, and every text of the user's is escaped."""
    from bokeh.embed import components
    from bokeh.resources import Resources

    plots = {f"{s.anchor}.{name}": plot for s in sections for name, plot in s.plots.items()}
    _gathered(list(plots.values()))
    script, places = components(plots) if plots else ("", {})
    return TEMPLATES.get_template("page.html").render(
        front=front, sections=[(s.anchor, s.title, _rendered(s, places)) for s in sections],
        bokeh=Markup(Resources(mode="inline", components=["bokeh"]).render_js()), plots=Markup(script),
        style=_asset("style.css"), behaviour=_asset("page.js"),
    )  # fmt: skip


def _gathered(plots: Sequence[Any]) -> None:
    """Put plots of no document into one. One after another, bokeh would go through all of them again for each."""
    from bokeh.document import Document

    if any(plot.document is not None for plot in plots):
        return
    document = Document()
    with document.models.freeze():
        for plot in plots:
            document.add_root(plot)


def save_page(path: str | os.PathLike[str], page: str) -> None:
    """Write a page, all or nothing; names of files need not be text. Raises BadInput when it cannot be written."""
    save_text(Path(path), page.encode(errors="replace").decode())


def _rendered(section: Section, places: Mapping[str, str]) -> Markup:
    """The section's template, filled in; `places` are the elements that bokeh draws in, by anchor and name."""
    plots = {
        name: Markup('<div class="drawn">{}</div>').format(Markup(places[f"{section.anchor}.{name}"]))
        for name in section.plots
    }
    return Markup(
        TEMPLATES.get_template(f"{section.template or section.anchor}.html").render(section.words, plots=plots)
    )


def _asset(name: str) -> Markup:
    """Our own style or script, which goes in as it is."""
    return Markup((Path(__file__).with_name("templates") / name).read_text(encoding="utf-8"))
