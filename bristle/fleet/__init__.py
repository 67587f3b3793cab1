"""Many valves at once: the same work on every recording set, on Dask, with one table of results and one page.

It needs the libraries of the extra ``fleet``.
"""

from bristle.fleet.cluster import opened
from bristle.fleet.items import FleetItem, fleet_items
from bristle.fleet.page import write_fleet_page
from bristle.fleet.results import read_results
from bristle.fleet.run import run_fleet

__all__ = ["FleetItem", "fleet_items", "opened", "read_results", "run_fleet", "write_fleet_page"]
