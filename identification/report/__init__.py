"""The report of a fit: one self-contained HTML page that opens without a network."""

from identification.report._page import page, write_report

__all__ = ["page", "write_report"]
