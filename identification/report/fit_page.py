"""The page of a fit: which sections it has, and its front."""

from __future__ import annotations

import os
from collections.abc import Callable
from datetime import UTC, datetime

from identification.report.assembly import Front, assembled, save_page
from identification.report.openings import fit_opening
from identification.report.section import Section
from identification.report.sections.crosscheck import crosscheck
from identification.report.sections.friction import friction
from identification.report.sections.headline import headline
from identification.report.sections.loop import loop
from identification.report.sections.meaning import meaning
from identification.report.sections.origin import origin
from identification.report.sections.parameters import parameters
from identification.report.sections.residual import residual
from identification.report.sections.signals import signals
from identification.result import FitResult
from recordings import ReportOpening

SECTIONS: tuple[Callable[[FitResult], Section], ...] = (
    headline, parameters, signals, residual, loop, friction, crosscheck, meaning, origin,
)  # fmt: skip
"""The sections, in the order of the page."""


def write_report(path: str | os.PathLike[str], identification: FitResult) -> None:
    """Write the report of a fit as one HTML file, all or nothing. Raises BadInput when the path cannot be written."""
    save_page(path, page(identification))


def page(identification: FitResult) -> str:
    """The report as one self-contained HTML page; it needs no network, and every text of the user's is escaped."""
    return assembled(
        front("Valve identification", identification, fit_opening(identification)),
        [s(identification) for s in SECTIONS],
    )


def front(kind: str, identification: FitResult, opening: ReportOpening) -> Front:
    """The front of the page of a fit or a trace: plant, recordings, date."""
    tag = identification.model.plant.get("tag")
    fitted, held = (", ".join(t.name for t in some) for some in (identification.trajectories, identification.holdout))
    lines = f"Fitted to {fitted}" + (f"; judged on {held}" if held else ""), f"Report of {datetime.now(UTC):%Y-%m-%d}"
    heading = f"Valve {tag}" if tag else "Fitted plant"
    return Front(kind, heading, lines, f"{tag or fitted} – {kind.lower()}", opening)
