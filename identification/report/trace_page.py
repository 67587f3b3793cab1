"""The page of a trace: the answer first, then where it shows, what was tried, and the model that came out."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial

from identification.report.assembly import assembled, save_page
from identification.report.fit_page import front
from identification.report.openings import trace_opening
from identification.report.section import Section
from identification.report.sections.crosscheck import crosscheck
from identification.report.sections.friction import friction
from identification.report.sections.headline import headline
from identification.report.sections.loop import loop
from identification.report.sections.meaning import meaning
from identification.report.sections.origin import origin
from identification.report.sections.parameters import parameters
from identification.report.sections.signals import signals
from identification.report.trace.answer import answer_section
from identification.report.trace.candidates import candidates
from identification.report.trace.pictures import pictures
from identification.report.trace.wording import answer
from identification.result import FitResult
from identification.tracing.result import TraceResult

STORY: tuple[Callable[[TraceResult], Section], ...] = (answer_section, pictures, candidates)
"""The sections of the trace itself."""
MODEL: tuple[Callable[[FitResult], Section], ...] = (
    partial(headline, traced=True), parameters, signals, loop, friction, crosscheck, meaning, origin,
)  # fmt: skip
"""The sections of the model that came out. What it leaves was told before."""


def write_trace_report(path: str | os.PathLike[str], trace: TraceResult) -> None:
    """Write the report of a trace as one self-contained HTML file, all or nothing. Raises BadInput when it cannot be
    written.
    """
    save_page(path, trace_page(trace))


def trace_page(trace: TraceResult) -> str:
    """The report as one self-contained HTML page."""
    sections = [*(section(trace) for section in STORY), *(section(trace.final) for section in MODEL)]
    opening = trace_opening(trace, answer(trace))
    return assembled(front("Valve trace", trace.final, opening), sections)
