"""What the pages of detectors share: how they look on screen and on A4, and how they open."""

from __future__ import annotations

from datetime import UTC, datetime
from html import escape

from recordings import ReportOpening

_COLOURS = {"good": "#0b7a5c", "watch": "#9a5b00", "repair": "#b3261e"}

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem; color: #1c2127; }
h1 { overflow-wrap: anywhere; } h2 { margin: 2.2rem 0 .4rem; font-size: 1.25rem; }
.note { max-width: 60rem; color: #4a525c; margin: .2rem 0 .8rem; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
td, th { padding: 2px 8px; border-bottom: 1px solid #d5d9df; text-align: left; white-space: nowrap; }
th { background: #f3f5f7; position: sticky; top: 0; } td.long { white-space: normal; min-width: 22rem; }
.wide { overflow: auto; max-height: 44rem; } summary { cursor: pointer; padding: 4px 0; }
.opening { border-left: 5px solid; background: #f3f5f7; padding: 4px 14px; } .opening p { margin: 4px 0; }
@page { size: A4; margin: 14mm 12mm; }
@media print {
  body { margin: 0; padding: 0; max-width: none; font-size: 11px; } .wide { overflow: visible; max-height: none; }
  table { font-size: 9px; } td, th { white-space: normal; overflow-wrap: anywhere; position: static; padding: 2px 4px; }
  td.long { min-width: 0; } tr, .opening { break-inside: avoid; } h2 { break-after: avoid; }
}
"""


def opening_html(opening: ReportOpening) -> str:
    """Verdict, confidence and next action."""
    said = f"{opening.shape} {opening.word.capitalize()}: {opening.why}"
    lines = (("Verdict", said), ("Confidence", opening.sure), ("Next", opening.action))
    words = "".join(f"<p><b>{name}:</b> {escape(text)}</p>" for name, text in lines)
    return f"<div class='opening' style='border-color: {_COLOURS[opening.word]}'>{words}</div>"


def dated(about: str) -> str:
    """What the page is about, and its date."""
    return f"<p class='note'>{escape(about)} Report of {datetime.now(UTC):%Y-%m-%d}.</p>"


def whole_page(title: str, body: str, script: str = "") -> str:
    """One HTML page that needs no network; script : of bokeh's plots in it."""
    from bokeh.resources import Resources

    view = "<meta name='viewport' content='width=device-width, initial-scale=1'>"
    head = f"<meta charset='utf-8'>{view}<title>{escape(title)}</title><style>{_STYLE}</style>"
    inline = Resources(mode="inline", components=["bokeh"]).render_js() if script else ""
    heading = f"<h1>{escape(title)}</h1>"
    return f"<!DOCTYPE html><html lang='en'><head>{head}{inline}</head><body>{heading}{body}{script}</body></html>"
