"""The plant of a case as a model of the catalogue: what its laws are in the parameters of the effects."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.plants.effects import Fields, Valve, fields_of

PARAMETERS: dict[str, Callable[[Fields], dict[str, float]]] = {
    "asymmetric_coulomb": lambda f: {"a": f["asym_all"]},
    "asymmetric_viscous": lambda f: {"b": f["visc"] / 2},
    "position_dependent_friction": lambda f: {"a": f["spot"], "x0": f["spot_x"], "w": f["spot_w"], "b": 0.0},
    "position_speed_friction": lambda f: {
        "a1": f["bell_1"], "a2": f["bell_2"], "a3": f["bell_3"], "x0": f["bell_x"], "w": f["bell_w"],
        "u": f["bell_u"]},
    "load_dependent_friction": lambda f: {"c": f["load"]},
    "dwell_stiction": lambda f: {"a": f["dwell"], "gamma": f["dwell_t"], "d": f["dwell_d"]},
    "frictional_memory": lambda f: {"tau": f["late_lag"]},
    "stribeck_exponent": lambda f: {"e": 2.0 - f["curve"]},
    "nonlocal_presliding": lambda f: {"f": f["slip_f"], "d": f["slip_d"]},
    "friction_drift": lambda f: {"r": f["drift"]},
    "quadratic_drag": lambda f: {"c": f["drag"]},
    "hardening_spring": lambda f: {"k3": f["cubic"]},
    "contact_stiffness": lambda f: {"k": f["stop"], "x0": f["stop_x"]},
    "flow_force": lambda f: {"f": f["flow"], "x0": f["flow_x"], "w": f["flow_w"]},
    "periodic_force": lambda f: {
        "a": f["hum"] * np.cos(f["hum_phase"]), "b": f["hum"] * np.sin(f["hum_phase"]), "f": f["hum_f"]},
    "position_periodic_force": lambda f: {
        "a": f["screw"] * np.cos(f["screw_phase"]), "b": f["screw"] * np.sin(f["screw_phase"]), "pitch": f["screw_l"]},
    "force_offset_drift": lambda f: {"r": f["offset"]},
    "force_gain": lambda f: {"g": f["gain"]},
    "actuator_lag": lambda f: {"tau": f["lag"]},
    "dead_time": lambda f: {"tau": f["delay"]},
    "actuator_hysteresis": lambda f: {"h": f["loop"], "r": f["loop_r"]},
    "backlash": lambda f: {"width": f["play"]},
    "sensor_lag": lambda f: {"tau": f["out_lag"]},
    "sensor_nonlinearity": lambda f: {"q": f["arch"] / f["stroke"], "c": f["ess"] / f["stroke"], "L": f["stroke"]},
    "sensor_drift": lambda f: {"r": f["zero"]},
}  # fmt: skip
"""The parameters of an effect by symbol, from what its law of the `same` form does. Those of dwell_stiction
are near: a slow motion wipes out less of the rise in one formulation than in the other."""


def true_values(strengths: dict[str, float], valve: Valve) -> dict[str, float]:
    """All parameters of a valve with effects in their `same` form, by full name. Raises KeyError for an effect that no
    catalogue has.
    """
    fields = fields_of(strengths, valve) | {"stroke": valve.stroke}
    values = dict(valve.values)
    for effect in strengths:
        values |= {f"{effect}.{symbol}": float(value) for symbol, value in PARAMETERS[effect](fields).items()}
    values["lugre.sigma2"] += fields.get("visc", 0.0) / 2  # the mean of both directions, where one has more
    return values
