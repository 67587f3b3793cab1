"""Backlash as operators with `update(value) -> output`: exact, smooth, generalised, and inverted.

After the source document, section 2.2. They serve studies and tests; what a kernel simulates and fits is the effect
`backlash`.
"""

from simulator.backlash.inverse import BacklashInverse
from simulator.backlash.lines import Backlash
from simulator.backlash.play import GeneralisedPlay
from simulator.backlash.smooth import SmoothBacklash

__all__ = ["Backlash", "BacklashInverse", "GeneralisedPlay", "SmoothBacklash"]
