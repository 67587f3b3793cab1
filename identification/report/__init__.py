"""The report of a fit or a trace: one self-contained HTML page that opens without a network."""

from identification.report.fit_page import page, write_report
from identification.report.trace_page import write_trace_report

__all__ = ["page", "write_report", "write_trace_report"]
