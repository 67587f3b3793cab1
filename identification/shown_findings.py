"""Results that are sentences, tables and curves, and the ways in which all of them are shown."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

from identification.summary import html_table

if TYPE_CHECKING:
    from identification.report.findings_page import Findings


class ShownFindings(ABC):
    """A result with findings: a few lines at a prompt, a table in a notebook, pictures, and a page."""

    @abstractmethod
    def lines(self) -> list[str]:
        """The answer in lines for a terminal."""

    @abstractmethod
    def findings(self) -> Findings:
        """What its page shows."""

    def __repr__(self) -> str:
        return "\n".join(self.lines())

    def _repr_html_(self) -> str:
        found = self.findings()
        caption = f"{found.heading}: {found.opening.why}"
        return "".join(html_table(caption, heads, rows) for heads, rows in found.tables[:1])

    def plot(self) -> Any:
        """The pictures, one below the other, as a bokeh layout: ``bokeh.io.show(found.plot())``."""
        from identification.report.findings_page import stacked_findings

        return stacked_findings(self.findings())

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write the report, one self-contained HTML page. Raises BadInput when it cannot be written."""
        from identification.report.findings_page import write_findings

        write_findings(path, self.findings())
