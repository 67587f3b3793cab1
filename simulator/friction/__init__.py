"""Friction models of the source document, section 2.1, on plain numbers, with the fits that make them from data.

They serve studies and tests; what a kernel simulates and fits are the effects in `simulator.effects`.
"""

from simulator.friction.leuven import LeuvenFriction

__all__ = ["LeuvenFriction"]
