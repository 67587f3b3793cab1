"""The report of a fit or a trace: one self-contained HTML page that opens without a network; the figures of it."""

from identification.report.fit_page import page, write_report
from identification.report.notebook import figures, stacked
from identification.report.trace_page import write_trace_report

__all__ = ["figures", "page", "stacked", "write_report", "write_trace_report"]
