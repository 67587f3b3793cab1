"""Armstrong's seven-parameter model as one simulation, sticking and sliding (equation 2.8-2.10)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from recordings import Array, BadParameter


def _check(values: Mapping[str, float], positive: tuple[str, ...]) -> None:
    """Raise BadParameter for a value that is not finite or negative, or 0 where it is to be positive."""
    for name, value in values.items():
        if not 0 <= value < np.inf or (name in positive and value == 0):
            remedy = "more than 0" if name in positive else "0 or more"
            raise BadParameter(name, f"{value:g}", "it is out of range", remedy)


@dataclass(frozen=True)
class SevenParameters:
    """The parameters of (2.8)-(2.10).

    coulomb : F_c [N]; viscous : F_v [N s/m]; stribeck : F_s,inf [N], the Stribeck friction after a long rest, beyond
    F_c; stiffness : k_t [N/m]; speed : characteristic velocity of the Stribeck friction [m/s]; memory : tau_L [s], the
    time by which the Stribeck friction is late; rise : gamma [s], 0 for no rising static friction.
    Raises BadParameter for a value that is negative, and for a stiffness or speed that is not positive.
    """

    coulomb: float
    viscous: float
    stribeck: float
    stiffness: float
    speed: float
    memory: float = 0.0
    rise: float = 0.0

    def __post_init__(self) -> None:
        _check(vars(self), ("stiffness", "speed"))


@dataclass(frozen=True)
class Drive:
    """A mass [kg] that a controller moves along a reference: u = stiffness e + damping de/dt + integral of e times it.

    stiffness [N/m], damping [N s/m], integral [N/(m s)]. With integral 0 it is the PD control of Table 2.2, or a body
    that is pulled by a spring. Raises BadParameter for a mass or stiffness that is not positive.
    """

    mass: float
    stiffness: float
    damping: float = 0.0
    integral: float = 0.0

    def __post_init__(self) -> None:
        _check(vars(self), ("mass", "stiffness"))


@dataclass(frozen=True)
class StickSlip:
    """What a drive did: t [s], x [m], v [m/s], force : of the controller [N], friction : on the body [N], sticking
    (n_samples each)."""

    t: Array
    x: Array
    v: Array
    force: Array
    friction: Array
    sticking: Array

    @property
    def slips(self) -> int:
        """How often it broke away."""
        return int(np.sum(np.diff(self.sticking.astype(int)) < 0))


def simulate_drive(
    friction: SevenParameters,
    drive: Drive,
    reference: Array,
    step: float = 1e-4,
    start: tuple[float, float] = (0.0, 0.0),
    damping: float | None = None,
) -> StickSlip:
    """A drive with the friction of the seven parameters, along a reference (n_samples) [m], one sample a `step` [s].

    start : first x [m] and v [m/s]; at v = 0 it sticks, relaxed, with all of its static friction there.

    The document has two models, one for sticking and one for sliding. Here they are joined. It sticks to a place that
    is chosen on arrival so that the force does not jump; (2.8) holds until the force exceeds F_c + F_s(gamma, t2)
    (2.10), t2 being the time since arrival; then (2.9) holds, with the velocity a time tau_L ago from a buffer, until
    the velocity turns; what is left of the Stribeck friction then is F_s,a. damping [N s/m] : of the sticking contact,
    which (2.8) has none of; a tenth of the critical one where not given.
    Raises BadParameter for a step that does not resolve the contact, or a reference that is not finite.
    """
    from simulator.friction import armstrong_loop

    r = np.ascontiguousarray(reference, dtype=float)
    own = friction.stiffness + drive.stiffness
    longest = 0.2 * np.sqrt(drive.mass / own)
    if not 0 < step <= longest:
        raise BadParameter("step", f"{step:g}", "it does not resolve the sticking contact", f"up to {longest:.2g} s")
    if r.ndim != 1 or len(r) < 2 or not np.isfinite(r).all():
        raise BadParameter("reference", r.shape, "it is no finite row", "give (n_samples) in m, two or more")
    c = 0.2 * np.sqrt(friction.stiffness * drive.mass) if damping is None else damping
    model = np.array([*vars(friction).values(), c])
    out = np.empty((5, len(r)))
    armstrong_loop.run(r, step, model, np.array(list(vars(drive).values())), np.array(start, dtype=float), out)
    t: Array = step * np.arange(len(r), dtype=float)
    return StickSlip(t, out[0], out[1], out[2], out[3], out[4] > 0)
