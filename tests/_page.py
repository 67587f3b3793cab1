"""Reads an HTML page for tests: its words, tables, scripts, and every address in it."""

from __future__ import annotations

import re
from collections import defaultdict
from html.parser import HTMLParser

ADDRESSES = ("src", "href", "action", "data", "poster", "srcset", "background", "formaction", "manifest", "ping")
SILENT = ("script", "style")
RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
NARROW = "\N{NARROW NO-BREAK SPACE}"


class Page(HTMLParser):
    """A page, read. sections : text by the id of the section; tables : rows of cell texts by section; scripts : their
    texts; addresses : values of attributes that may fetch or lead somewhere; attributes : (element, name, value).
    """

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.sections: dict[str, str] = defaultdict(str)
        self.tables: dict[str, list[list[str]]] = defaultdict(list)
        self.scripts: list[str] = []
        self.addresses: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.title = ""
        self._section, self._open, self._in_cell = "", [""], False
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._open.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        self.addresses += [value or "" for name, value in attrs if name in ADDRESSES]
        if tag == "section":
            self._section = dict(attrs).get("id") or ""
        if tag == "script":
            self.scripts.append("")
        if tag == "tr":
            self.tables[self._section].append([])
        if tag in ("td", "th"):
            self.tables[self._section][-1].append("")
            self._in_cell = True

    def handle_endtag(self, tag: str) -> None:
        if tag in self._open:
            while self._open.pop() != tag:
                pass
        if tag == "section":
            self._section = ""
        if tag in ("td", "th"):
            self._in_cell = False

    def handle_data(self, data: str) -> None:
        if self._open[-1] == "script":
            self.scripts[-1] += data
        if self._open[-1] == "title":
            self.title += data
        if self._open[-1] in SILENT:
            return
        words = re.sub(r"[ \t\n]+", " ", data).strip(" ")
        self.sections[self._section] += f"{words} " if words else ""
        if self._in_cell:
            row = self.tables[self._section][-1]
            row[-1] = f"{row[-1]} {words}".strip()


def as_number(text: str) -> float:
    """The number that a page shows, with its narrow spaces, minus sign and power of ten."""
    digits, _, power = text.replace(NARROW, "").replace("−", "-").partition("×10")
    return float(digits) * 10.0 ** int(power.translate(RAISED) or 0)
