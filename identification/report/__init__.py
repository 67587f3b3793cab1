"""Reports of fits, traces and comparisons: self-contained HTML pages that open without a network; their figures."""

from identification.report.comparison_page import stacked_comparison, write_comparison_report
from identification.report.fit_page import page, write_report
from identification.report.fleet_page import Cell, Distribution, FleetSection, FleetTable, write_fleet_report
from identification.report.notebook import figures, stacked
from identification.report.trace_page import write_trace_report

__all__ = [
    "Cell",
    "Distribution",
    "FleetSection",
    "FleetTable",
    "figures",
    "page",
    "stacked",
    "stacked_comparison",
    "write_comparison_report",
    "write_fleet_report",
    "write_report",
    "write_trace_report",
]
