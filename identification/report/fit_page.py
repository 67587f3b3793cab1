"""The whole page: every section rendered, bokeh's script inside, nothing to fetch."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from identification.report.crosscheck import crosscheck
from identification.report.friction import friction
from identification.report.headline import headline
from identification.report.loop import loop
from identification.report.meaning import meaning
from identification.report.origin import origin
from identification.report.parameters import parameters
from identification.report.residual import residual
from identification.report.section import Section
from identification.report.signals import signals
from identification.result import Identification
from recordings import save_text

SECTIONS: tuple[Callable[[Identification], Section], ...] = (
    headline, parameters, signals, residual, loop, friction, crosscheck, meaning, origin,
)  # fmt: skip
"""The sections, in the order of the page."""
TEMPLATES = Environment(
    loader=PackageLoader("identification.report"), autoescape=True, undefined=StrictUndefined,
    trim_blocks=True, lstrip_blocks=True,
)  # fmt: skip


def write_report(path: str | os.PathLike[str], identification: Identification, story: Sequence[Section] = ()) -> None:
    """Write the report of a fit as one HTML file, all or nothing; story : sections that go before all others.

    Raises BadInput when the path cannot be written.
    """
    text = page(identification, story).encode(errors="replace").decode()  # file names need not be text
    save_text(Path(path), text)


def page(identification: Identification, story: Sequence[Section] = ()) -> str:
    """The report as one self-contained HTML page; it needs no network, and every text of the user's is escaped."""
    from bokeh.embed import components
    from bokeh.resources import Resources

    sections = [*story, *(section(identification) for section in SECTIONS)]
    script, places = components({f"{s.anchor}.{name}": plot for s in sections for name, plot in s.plots.items()})
    return TEMPLATES.get_template("page.html").render(
        title=_title(identification), heading=_heading(identification), subtitle=_subtitle(identification),
        sections=[(s.anchor, s.title, _rendered(s, places)) for s in sections],
        bokeh=Markup(Resources(mode="inline", components=["bokeh"]).render_js()), plots=Markup(script),
        style=_asset("style.css"), behaviour=_asset("page.js"),
    )  # fmt: skip


def _rendered(section: Section, places: Mapping[str, str]) -> Markup:
    """The section's template, filled in; `places` are the elements that bokeh draws in, by anchor and name."""
    plots = {
        name: Markup('<div class="drawn">{}</div>').format(Markup(places[f"{section.anchor}.{name}"]))
        for name in section.plots
    }
    return Markup(TEMPLATES.get_template(f"{section.anchor}.html").render(section.words, plots=plots))


def _title(identification: Identification) -> str:
    names = ", ".join(t.name for t in identification.trajectories)
    return str(identification.model.plant.get("tag") or names)


def _heading(identification: Identification) -> str:
    tag = identification.model.plant.get("tag")
    return f"Valve {tag}" if tag else "Fitted plant"


def _subtitle(identification: Identification) -> str:
    fitted, held = (", ".join(t.name for t in some) for some in (identification.trajectories, identification.holdout))
    return f"fitted to {fitted}" + (f"; judged on {held}" if held else "")


def _asset(name: str) -> Markup:
    """Our own style or script, which goes in as it is."""
    return Markup((Path(__file__).with_name("templates") / name).read_text(encoding="utf-8"))
