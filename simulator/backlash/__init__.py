"""Backlash as operators with `update(value) -> output`: exact, smooth, generalised, inverted, and from measured data.

After the source document, section 2.2. They serve studies and tests; what a kernel simulates and fits is the effect
`backlash`.
"""

from simulator.backlash.adaptive import AdaptiveBacklashInverse
from simulator.backlash.fit import BacklashFit, SmoothBacklashFit, fit_backlash, fit_smooth_backlash
from simulator.backlash.inverse import BacklashInverse
from simulator.backlash.lines import Backlash
from simulator.backlash.play import GeneralisedPlay
from simulator.backlash.smooth import SmoothBacklash

__all__ = [
    "AdaptiveBacklashInverse",
    "Backlash",
    "BacklashFit",
    "BacklashInverse",
    "GeneralisedPlay",
    "SmoothBacklash",
    "SmoothBacklashFit",
    "fit_backlash",
    "fit_smooth_backlash",
]
