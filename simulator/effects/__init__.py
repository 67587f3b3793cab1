"""The catalogue: every effect the toolkit knows, base effects first. Adding one is one file and one line here."""

from __future__ import annotations

from simulator._effect import Catalogue
from simulator.effects.inertia import Inertia
from simulator.effects.lugre import LuGre
from simulator.effects.spring import Spring

BASE = ("inertia", "spring", "lugre")
"""The effects of the base model."""

CATALOGUE = Catalogue((Inertia(), Spring(), LuGre()))

__all__ = ["BASE", "CATALOGUE"]
