"""Many valves at once: the same work on every recording set, on Dask, with one table of results and one page."""
