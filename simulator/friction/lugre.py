"""LuGre friction with its observer, and a body that is moved under them (equation 2.13-2.19)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from recordings import Array, BadParameter


@dataclass(frozen=True)
class LuGreParameters:
    """sigma0 [N/m], sigma1, sigma2 [N s/m] of (2.15), and fc, fs [N], vs [m/s] of g(v) in (2.17).

    Raises BadParameter for a value that is negative, and for sigma0, fc, fs or vs that is not positive.
    """

    sigma0: float
    sigma1: float
    sigma2: float
    fc: float
    fs: float
    vs: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            positive = name not in ("sigma1", "sigma2")
            if not 0 <= value < np.inf or (positive and value == 0):
                raise BadParameter(name, f"{value:g}", "it is out of range", "more than 0" if positive else "0 or more")

    def level(self, velocity: ArrayLike) -> Array:
        """sigma0 g(v) [N] (2.17), without the viscous part."""
        v = np.asarray(velocity, dtype=float)
        return self.fc + (self.fs - self.fc) * np.exp(-((v / self.vs) ** 2))

    def steady(self, velocity: ArrayLike) -> Array:
        """F_ss (n_samples) [N] at steady velocities [m/s] (2.16, 2.17)."""
        v = np.asarray(velocity, dtype=float)
        return self.level(v) * np.sign(v) + self.sigma2 * v

    def deflection(self, velocity: ArrayLike) -> Array:
        """z_ss = g(v) sgn(v) (n_samples) [m] (2.14)."""
        v = np.asarray(velocity, dtype=float)
        return self.level(v) * np.sign(v) / self.sigma0

    def follow(self, time: ArrayLike, position: ArrayLike) -> Array:
        """The friction force [N] (n_samples) against a motion: time [s], rising, and position [m], both (n_samples).

        Between samples the velocity is constant, and z is exact; the force is that at the end of the interval before
        each sample, 0 at the first, where the bristle is relaxed. Raises BadParameter for shapes that differ and times
        that do not rise.

        >>> friction = LuGreParameters(1e6, 0.0, 100.0, 50.0, 50.0, 1e-3)
        >>> round(float(friction.follow([0.0, 1.0, 2.0], [0.0, 0.01, 0.02])[-1]), 6)
        51.0
        """
        from simulator.friction import lugre_loop

        t, x = np.ascontiguousarray(time, dtype=float), np.ascontiguousarray(position, dtype=float)
        if t.shape != x.shape or t.ndim != 1 or not len(t) or not (np.isfinite(x).all() and (np.diff(t) > 0).all()):
            raise BadParameter("time", t.shape, f"it does not rise beside positions {x.shape}", "give equal rows")
        out = np.zeros(len(t))
        lugre_loop.follow(np.diff(t), np.diff(x) / np.diff(t), _vector(self), out)
        return out


@dataclass(frozen=True)
class ServoDesign:
    """Controller of `simulate_servo` on a mass [kg]: proportional [N/m], derivative [N s/m], integral [N/(m s)].

    For velocity control they act on the velocity error: proportional [N s/m], derivative [kg], integral [N/m].
    correction : K of the observer (2.18), >= 0.
    """

    mass: float
    proportional: float
    derivative: float = 0.0
    integral: float = 0.0
    correction: float = 0.0


@dataclass(frozen=True)
class ServoRun:
    """t [s], x [m], v [m/s], error (of position [m] or velocity [m/s]), friction and estimate of it [N] (n_samples)."""

    t: Array
    x: Array
    v: Array
    error: Array
    friction: Array
    estimate: Array


def strictly_positive_real(model: LuGreParameters, design: ServoDesign) -> bool:
    """Whether G(s) = (sigma1 s + sigma0)/(J s^2 + H(s)) is so, H the controller: then e -> 0 by (2.18) with K > 0.

    Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE TAC 40(3), 1995, theorem 1. On a grid of frequencies.
    """
    closed = np.array([design.mass, design.derivative, design.proportional, design.integral])
    if not (np.roots(closed if design.integral else closed[:-1]).real < 0).all():
        return False
    s = 1j * np.geomspace(1e-4, 1e6, 4000)
    G = (model.sigma1 * s + model.sigma0) / (design.mass * s**2 + design.derivative * s + design.proportional
                                             + design.integral / s)  # fmt: skip
    return bool((G.real > 0).all())


def simulate_servo(
    model: LuGreParameters,
    design: ServoDesign,
    reference: ArrayLike,
    step: float,
    compensation: bool = True,
    believed: LuGreParameters | None = None,
    control: Literal["position", "velocity"] = "position",
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> ServoRun:
    """A body with LuGre friction under m dv/dt = u - F, u = m a_d - H(e) + F-hat where compensated, F-hat by (2.19).

    reference (n_samples), every `step` [s], smooth: positions x_d [m], or velocities v_d [m/s]; believed : parameters
    of the observer, the true ones where not given; start : x [m], v [m/s] and z [m] of the body. The observer starts at
    z-hat = 0. The bristle is integrated exactly over a step (velocity held), the body by symplectic Euler.
    Raises BadParameter for a design with a mass that is not positive or a negative gain, for a step that does not
    resolve the bristle, and a reference that is not finite.
    """
    from simulator.friction import lugre_loop

    for name, value in vars(design).items():
        if not 0 <= value < np.inf or (name == "mass" and value == 0):
            raise BadParameter(name, f"{value:g}", "it is out of range", "0 or more, a mass more than 0")
    longest = 0.2 * np.sqrt(design.mass / model.sigma0)
    if not 0 < step <= longest:
        raise BadParameter("step", f"{step:g}", "it does not resolve the bristle", f"up to {longest:.2g} s")
    r = np.ascontiguousarray(reference, dtype=float)
    if r.ndim != 1 or len(r) < 3 or not np.isfinite(r).all():
        raise BadParameter("reference", r.shape, "it is no finite row", "give (n_samples), three or more")
    rate = np.gradient(r, step)
    rows = np.column_stack([r, rate, np.gradient(rate, step)] if control == "position" else [r, r, rate])
    out = np.empty((5, len(r)))
    lugre_loop.run(
        rows, step, _vector(model), _vector(believed or model), np.array(list(vars(design).values())), compensation,
        control == "velocity", np.array(start, dtype=float), out,
    )  # fmt: skip
    t: Array = step * np.arange(len(r), dtype=float)
    return ServoRun(t, *out)


def _vector(model: LuGreParameters) -> Array:
    return np.array(list(vars(model).values()), dtype=float)
