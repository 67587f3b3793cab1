"""The live page of a plant: a process of its own that only looks, on loopback unless told otherwise."""

from hil.page.access import PageSettings
from hil.page.exchange import WatchedPlant
from hil.page.shown_monitor import ShownMonitor
from hil.page.task import Page, PageEnded

__all__ = ["Page", "PageEnded", "PageSettings", "ShownMonitor", "WatchedPlant"]
