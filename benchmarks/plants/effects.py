"""What each effect does to the plant of `benchmarks.plants`, in its own formulation, and effects no catalogue has.

A law takes a strength (a small number that says how strong, 0 for not at all) and a `Valve`, and returns fields of
`Physics`. Every catalogue effect has a `same` form, the law the catalogue states, and most have an `other` form:
another law that an engineer would call by the same name (a raised cosine instead of a bell, a drift that levels off
instead of a straight one, Dahl's loop instead of play operators).
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.plants.physics import Physics
from simulator import random_valve

Fields = dict[str, float]


@dataclass(frozen=True)
class Valve:
    """A random valve: base parameters by full name, stroke [m], the noise of its sensors, and its seed."""

    seed: int
    values: dict[str, float]
    stroke: float
    position_noise: float
    force_noise: float

    @classmethod
    def of(cls, seed: int) -> Valve:
        """The valve of a seed: position noise 1e-4 to 4e-4 of the stroke, force noise 0.1 % of the span K x stroke."""
        values, stroke = random_valve(seed)
        share = 10 ** np.random.default_rng([seed, 7]).uniform(-4, np.log10(4e-4))
        return cls(seed, values, stroke, float(share * stroke), 1e-3 * values["spring.K"] * stroke)

    @property
    def span(self) -> float:
        """Force of the spring over the stroke [N]."""
        return self.values["spring.K"] * self.stroke

    @property
    def load(self) -> float:
        """Actuating force at mid-stroke [N]."""
        return self.values["spring.F0"] + 0.5 * self.span

    @property
    def friction(self) -> float:
        """Break-away force [N]."""
        return self.values["lugre.fs"]

    def draw(self, name: str, low: float, high: float) -> float:
        """A number that belongs to this valve and a name: where a tight spot sits, how fast a disturbance is."""
        rng = np.random.default_rng([self.seed, zlib.crc32(name.encode())])
        return float(rng.uniform(low, high))

    def place(self, name: str) -> float:
        """A position [m] well inside the stroke."""
        return self.draw(name, 0.35, 0.65) * self.stroke

    def physics(self, fields: Fields | None = None) -> Physics:
        """The plant, with what is added to the base."""
        return Physics(*self.values.values())._replace(stroke=self.stroke, **(fields or {}))


Law = Callable[[float, Valve], Fields]


def _drifting(name: str, unit: Callable[[Valve], float]) -> tuple[Law, Law]:
    """A linear drift per 50 s, and one that levels off."""
    return (
        lambda s, v: {name: s * unit(v) / 50.0},
        lambda s, v: {f"{name}_end": s * unit(v), f"{name}_T": v.draw(name, 30.0, 60.0)},
    )


_FRICTION_DRIFT = _drifting("drift", lambda v: 1.0)
_OFFSET_DRIFT = _drifting("offset", lambda v: v.friction)
_ZERO_DRIFT = _drifting("zero", lambda v: v.stroke)

SAME: dict[str, Law] = {
    "asymmetric_coulomb": lambda s, v: {"asym_all": s},
    "asymmetric_viscous": lambda s, v: {"visc": 2.0 * s * v.values["lugre.sigma2"]},
    "position_dependent_friction": lambda s, v: {
        "spot": s, "spot_x": v.place("spot"), "spot_w": v.draw("width", 0.08, 0.2) * v.stroke},
    "position_speed_friction": lambda s, v: {
        "bell_1": s, "bell_2": -0.5 * s, "bell_3": s, "bell_x": v.place("bells"),
        "bell_w": v.draw("bell", 0.15, 0.25) * v.stroke, "bell_u": v.draw("film", 0.02, 0.06)},
    "load_dependent_friction": lambda s, v: {"load": s / v.load},
    "dwell_stiction": lambda s, v: {
        "dwell": s, "dwell_t": v.draw("dwell", 0.3, 2.0), "dwell_d": v.draw("wipe", 2e-4, 1e-3)},
    "frictional_memory": lambda s, v: {"late_lag": 0.05 * s},
    "stribeck_exponent": lambda s, v: {"curve": s},
    "nonlocal_presliding": lambda s, v: {
        "slip_f": s * v.friction,
        "slip_d": max(v.draw("slip", 3e-4, 8e-4), 2.0 * v.friction / v.values["lugre.sigma0"]),
        "slip_n": 4},
    "friction_drift": _FRICTION_DRIFT[0],
    "quadratic_drag": lambda s, v: {"drag": s * v.friction / 0.04},
    "hardening_spring": lambda s, v: {"cubic": s * v.span / v.stroke**3},
    "contact_stiffness": lambda s, v: {"stop": s * v.values["spring.K"], "stop_x": v.draw("stop", 0.6, 0.8) * v.stroke},
    "flow_force": lambda s, v: {
        "flow": s * v.friction, "flow_x": v.place("flow"), "flow_w": v.draw("mouth", 0.12, 0.25) * v.stroke},
    "periodic_force": lambda s, v: {
        "hum": s * v.friction, "hum_f": v.draw("hum", 0.8, 6.0), "hum_phase": v.draw("phase", 0.0, 6.0)},
    "position_periodic_force": lambda s, v: {
        "screw": s * v.friction, "screw_l": v.draw("pitch", 0.1, 0.25) * v.stroke, "screw_phase": v.draw("turn", 0, 6)},
    "force_offset_drift": _OFFSET_DRIFT[0],
    "force_gain": lambda s, v: {"gain": s},
    "actuator_lag": lambda s, v: {"lag": 0.1 * s},
    "dead_time": lambda s, v: {"delay": 0.1 * s},
    "actuator_hysteresis": lambda s, v: {
        "loop": s * v.friction, "loop_r": v.draw("loop", 0.05, 0.2) * v.span, "loop_n": 4},
    "backlash": lambda s, v: {"play": 0.02 * s * v.stroke},
    "sensor_lag": lambda s, v: {"out_lag": 0.1 * s},
    "sensor_nonlinearity": lambda s, v: {"arch": 0.1 * s * v.stroke, "ess": 0.05 * s * v.stroke},
    "sensor_drift": _ZERO_DRIFT[0],
}  # fmt: skip
"""The laws of the catalogue, by effect id."""

OTHER: dict[str, Law] = {
    "asymmetric_coulomb": lambda s, v: {"asym_coulomb": s},
    "position_dependent_friction": lambda s, v: {
        "spot": s, "spot_x": v.place("spot"), "spot_w": v.draw("width", 0.15, 0.3) * v.stroke, "spot_hann": 1.0},
    "load_dependent_friction": lambda s, v: {"load": s / v.load**0.8, "load_e": 0.8},
    "dwell_stiction": lambda s, v: SAME["dwell_stiction"](s, v) | {"dwell_hyperbola": 1.0},
    "frictional_memory": lambda s, v: {"late": 0.05 * s},
    "nonlocal_presliding": lambda s, v: SAME["nonlocal_presliding"](s, v) | {"slip_n": 8, "slip_ramp": 0.6},
    "friction_drift": _FRICTION_DRIFT[1],
    "quadratic_drag": lambda s, v: {"drag": s * v.friction / 0.06, "drag_e": 1.75},
    "hardening_spring": lambda s, v: {"cubic": s * v.span / v.stroke**3, "cubic_x": -0.15 * v.stroke},
    "contact_stiffness": lambda s, v: {
        "stop": s * v.values["spring.K"] / (0.1 * v.stroke) ** 0.2, "stop_e": 1.2,
        "stop_x": v.draw("stop", 0.6, 0.8) * v.stroke},
    "flow_force": lambda s, v: SAME["flow_force"](s, v) | {"flow_bell": 1.0},
    "periodic_force": lambda s, v: SAME["periodic_force"](s, v) | {"hum_triangle": 1.0},
    "position_periodic_force": lambda s, v: SAME["position_periodic_force"](s, v) | {"screw_h": 0.1},
    "force_offset_drift": _OFFSET_DRIFT[1],
    "actuator_lag": lambda s, v: {"lag": 0.08 * s, "lag2": 0.02 * s},
    "dead_time": lambda s, v: {"out_delay": 0.1 * s},
    "actuator_hysteresis": lambda s, v: {"dahl": s * v.friction, "dahl_r": v.draw("loop", 0.05, 0.2) * v.span},
    "backlash": lambda s, v: {"play": 0.02 * s * v.stroke, "play_at": v.draw("gap", -0.9, 0.9)},
    "sensor_lag": lambda s, v: {"out_lag": 0.08 * s, "out_lag2": 0.02 * s},
    "sensor_nonlinearity": lambda s, v: {"arch_sine": 0.1 * s * v.stroke},
    "sensor_drift": _ZERO_DRIFT[1],
}  # fmt: skip
"""Other laws of the same name."""

OUTSIDE: dict[str, Law] = {
    "acceleration_friction": lambda s, v: {"accel": s},
    "closing_clamp": lambda s, v: {"clamp": s},
    "snapping_spring": lambda s, v: {
        "snap": -s * v.friction, "snap_x": v.place("snap"), "snap_w": 0.01 * v.stroke},
    "repeated_samples": lambda s, v: {},
    "saturated_sensor": lambda s, v: {"top": (1.2 - s) * v.stroke},
    "hose": lambda s, v: {
        "hose_m": s * v.values["mass.m"], "hose_k": s * v.values["mass.m"] * (6.28 * v.draw("hose", 3.0, 8.0)) ** 2,
        "hose_c": s * v.values["mass.m"] * 2.0},
    "friction_jump": lambda s, v: {"jump": s, "jump_t": v.draw("jump", 15.0, 25.0)},
    "quantised_force": lambda s, v: {"quantum": 0.2 * s * v.span, "quantum_t": 0.02},
    "creeping_spring": lambda s, v: {"creep": s * v.values["spring.K"], "creep_t": v.draw("creep", 1.0, 5.0)},
    "wavy_friction": lambda s, v: {"wave": s, "wave_l": v.draw("wave", 0.1, 0.2) * v.stroke},
}  # fmt: skip
"""Effects no catalogue entry describes: friction that grows with acceleration, a clamp that closes and opens at random
times, a spring that snaps through at mid-stroke, a sensor that repeats old samples, a sensor that saturates, a second
mass on a spring, a Coulomb level that jumps at one instant, a force that is quantised and held, a spring that creeps,
and friction that waves along the stroke."""

CLAMPS = 7.0
"""Mean time between closings of the clamp [s]; it stays closed for a fifth of it on average."""
STALL = 1.5
"""Mean time between stalls of the sensor that repeats samples [s]."""

KNOWN = {
    "asymmetric_coulomb": ("spring_preload_N",),
    "force_gain": ("moving_mass_kg", "spring_constant_N_per_m", "spring_preload_N"),
}
"""What has to be known of the plant for an effect to be told from the base at all."""
HELD = {
    "moving_mass_kg": "mass.m",
    "spring_constant_N_per_m": "spring.K",
    "spring_preload_N": "spring.F0",
}
"""The base parameter that each item of /plant gives."""

FIRST = {"frictional_memory": 0.1, "saturated_sensor": 0.3, "periodic_force": 0.1, "repeated_samples": 0.2}
"""Strength from which a calibration starts, where 0.05 is a bad guess."""


def law(effect: str, form: str = "same") -> Law:
    """The law of an effect by id; its `other` form where there is one. Raises KeyError for an unknown one."""
    if effect in OUTSIDE:
        return OUTSIDE[effect]
    return OTHER[effect] if form == "other" and effect in OTHER else SAME[effect]


def fields_of(strengths: dict[str, float], valve: Valve, form: str = "same") -> Fields:
    """All fields of several effects at once; two of them that claim one field are refused with a ValueError."""
    whole: Fields = {}
    for effect, strength in strengths.items():
        added = law(effect, form)(strength, valve)
        if whole.keys() & added.keys():
            raise ValueError(f"{effect} cannot be combined with {', '.join(strengths)}")
        whole |= added
    return whole
