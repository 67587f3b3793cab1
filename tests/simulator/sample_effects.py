"""Effects that exist for the tests: each uses another hook, so that what holds for them holds for effects to come."""

from __future__ import annotations

import casadi as ca

from simulator import Effect, Lag, Memory, Parameter, Relaxation, Site


def played(s, drive, width):
    """A play operator: s follows the drive at half the width behind. Touching is not moving, so that the derivative by
    a width of zero is the one towards a positive width."""
    up, down = drive - width / 2 - s, drive + width / 2 - s
    return s + ca.if_else(up > 0, up, 0) + ca.if_else(down < 0, down, 0)


class Drag(Effect):
    """F = c v abs(v): drag that grows with the square of speed."""

    id = "sample_drag"
    site = Site.FORCE
    sentence = "drag that grows with the square of speed"
    check = "the medium around the plug"
    parameters = (Parameter("c", "N s2/m2", "drag coefficient", scale=5e3, lower=0.0, neutral=0.0),)
    passive = True

    def force(self, q, p, s, ds):
        return p["c"] * q.v * ca.fabs(q.v)


class Slip(Effect):
    """F = k (x - a), the anchor a dragged along at the distance d: one Maxwell-slip element, a force that jumps."""

    id = "sample_slip"
    site = Site.FORCE
    sentence = "a contact that sticks and slips"
    check = "the seal lip"
    parameters = (
        Parameter("k", "N/m", "stiffness", scale=2e4, lower=0.0, neutral=0.0),
        Parameter("d", "m", "distance to slip", scale=1e-3, lower=0.0, positive=True),
    )
    memory = (Memory("a", "m", at_position=True),)
    passive = True

    def jump(self, q, p, s):
        return {"a": played(s["a"], q.x, 2 * p["d"])}

    def force(self, q, p, s, ds):
        return p["k"] * (q.x - s["a"])


class TightSpot(Effect):
    """Friction level times 1 + a exp(-((x - x0)/w)^2): a tight spot along the stroke."""

    id = "sample_tight_spot"
    site = Site.FORCE
    sentence = "a place along the stroke where friction is higher"
    check = "the stem for scoring"
    parameters = (
        Parameter("a", "1", "rise of the friction level", scale=0.5, lower=-0.9, neutral=0.0),
        Parameter("x0", "m", "place", scale=0.011),
        Parameter("w", "m", "half width", scale=0.003, lower=0.0, positive=True),
    )

    def friction_level(self, q, p, s):
        return 1 + p["a"] * ca.exp(-(((q.x - p["x0"]) / p["w"]) ** 2))


class Dwell(Effect):
    """Friction level times 1 + a (1 - exp(-T/tau)), dT/dt = 1 - abs(v) T / d: break-away grows with time at rest."""

    id = "sample_dwell"
    site = Site.FORCE
    sentence = "break-away friction that grows with time at rest"
    check = "the packing for ageing grease"
    parameters = (
        Parameter("a", "1", "rise of the friction level after a long rest", scale=0.3, lower=0.0, neutral=0.0),
        Parameter("tau", "s", "time of the rise", scale=0.3, lower=0.0, positive=True),
        Parameter("d", "m", "travel that wipes the rest out", scale=5e-5, lower=0.0, positive=True),
    )
    memory = (Memory("T", "s"),)

    def relax(self, q, p):
        return {"T": Relaxation(1.0, ca.fabs(q.v) / p["d"])}

    def friction_level(self, q, p, s):
        return 1 - p["a"] * ca.expm1(-s["T"] / p["tau"])


class InputLag(Effect):
    """tau du/dt = u_before - u: first-order lag of the actuating force."""

    id = "sample_input_lag"
    site = Site.INPUT
    sentence = "the actuating force lags"
    check = "the tubing between positioner and actuator"
    parameters = (Parameter("tau", "s", "time constant", scale=0.02, lower=0.0, neutral=0.0),)
    memory = (Memory("u", "N", at_force=True),)

    def relax(self, q, p):
        return {"u": Lag(q.u, p["tau"])}

    def input(self, q, p, s):
        return s["u"]


class InputPlay(Effect):
    """Play of a width w between the drive and the force: an input that jumps."""

    id = "sample_input_play"
    site = Site.INPUT
    sentence = "hysteresis between drive and force"
    check = "the actuator's linkage"
    parameters = (Parameter("w", "N", "width", scale=40.0, lower=0.0, neutral=0.0),)
    memory = (Memory("u", "N", at_force=True),)

    def jump(self, q, p, s):
        return {"u": played(s["u"], q.u, p["w"])}

    def input(self, q, p, s):
        return s["u"]


class Backlash(Effect):
    """Play of a width b between stem and sensor: an output that jumps."""

    id = "sample_backlash"
    site = Site.OUTPUT
    sentence = "play between stem and position sensor"
    check = "the feedback linkage"
    parameters = (Parameter("b", "m", "width", scale=5e-4, lower=0.0, neutral=0.0),)
    memory = (Memory("y", "m", at_position=True),)

    def jump(self, q, p, s):
        return {"y": played(s["y"], q.y, p["b"])}

    def output(self, q, p, s):
        return s["y"]


class SensorLag(Effect):
    """tau dy/dt = y_before - y: first-order lag of the position sensor."""

    id = "sample_sensor_lag"
    site = Site.OUTPUT
    sentence = "the position sensor lags"
    check = "the filter of the transmitter"
    parameters = (Parameter("tau", "s", "time constant", scale=0.02, lower=0.0, neutral=0.0),)
    memory = (Memory("y", "m", at_position=True),)

    def relax(self, q, p):
        return {"y": Lag(q.y, p["tau"])}

    def output(self, q, p, s):
        return s["y"]


class CurvedScale(Effect):
    """y + c y (L - y): a curved calibration, an output without memory."""

    id = "sample_curved_scale"
    site = Site.OUTPUT
    sentence = "a curved calibration of the position sensor"
    check = "the calibration against a dial gauge"
    parameters = (
        Parameter("c", "1/m", "curvature", scale=2.0, neutral=0.0),
        Parameter("L", "m", "calibrated range", scale=0.02, lower=0.0, positive=True),
    )

    def output(self, q, p, s):
        return q.y + p["c"] * q.y * (p["L"] - q.y)


SAMPLES = (Drag(), Slip(), TightSpot(), Dwell(), InputLag(), InputPlay(), Backlash(), SensorLag(), CurvedScale())
"""All of them; output effects in the order backlash, lag, curve."""
