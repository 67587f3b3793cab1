"""The catalogue: every effect the toolkit knows, base effects first. An effect is one file in a folder here.

The order is that of asking: signals pass from the recording to the stem through the input effects, from the stem to
the recording through the output effects.
"""

from __future__ import annotations

from recordings import classes_of
from simulator.effect import Catalogue, Effect

BASE = ("inertia", "spring", "lugre")
"""The effects of the base model."""

ORDER = (
    *BASE, "asymmetric_coulomb", "asymmetric_viscous", "position_dependent_friction", "position_speed_friction",
    "load_dependent_friction", "dwell_stiction", "frictional_memory", "stribeck_exponent", "nonlocal_presliding",
    "friction_drift", "quadratic_drag", "hardening_spring", "contact_stiffness", "flow_force",
    "periodic_force", "position_periodic_force", "force_offset_drift",
    "dead_time", "force_gain", "actuator_hysteresis", "actuator_lag",
    "backlash", "sensor_lag", "sensor_nonlinearity", "sensor_drift",
)  # fmt: skip
"""Effects whose place matters. One that is not among them stands at the end: see `Catalogue.extended`."""


def _place(effect: Effect) -> tuple[int, str]:
    return ORDER.index(effect.id) if effect.id in ORDER else len(ORDER), effect.id


CATALOGUE = Catalogue(tuple(sorted((kind() for kind in classes_of("simulator.effects", Effect)), key=_place)))
"""Every public effect that a module of the folders here defines."""

__all__ = ["BASE", "CATALOGUE"]
