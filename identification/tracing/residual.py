"""The residual when tracing ends: how large it is, where, and what to measure next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.tracing.models.model import Model
from identification.tracing.verdict import Selection
from recordings import Array

BINS = 12
"""Equally filled bins over which the residual is compared: enough to tell a place."""
AT_REST = 0.01
"""Speed below which a valve rests, as a share of its root mean square speed."""
QUANTITIES = {
    "position": ("m", "slow sweeps through that range in both directions and at two speeds"),
    "velocity": ("m/s", "sines of several amplitudes, so that such speeds occur at many positions"),
    "direction": ("1", "slow sweeps in both directions at several speeds"),
    "time": ("s", "the same test twice in a row and once more an hour later"),
    "time since reversal": ("s", "small reversals in the middle of the stroke, slow and fast"),
    "time at rest": ("s", "steps with rests of 1, 10 and 100 s between them"),
    "force": ("N", "the same motion at two supply or process pressures"),
}
"""What the residual force may depend on: its unit, and what to record to see more of it."""


@dataclass(frozen=True)
class ResidualDescription:
    """The residual force that no candidate explains. description : how large, in words; quantity : what it depends on
    most, of `QUANTITIES`; low, high : the range of it where the force is largest, in `unit`; only_held_out : whether
    the held-out recordings alone show it; share : of the base model's excess loss on the held-out recordings that the
    final model still has.
    """

    description: str
    quantity: str
    low: float
    high: float
    only_held_out: bool
    share: float

    @property
    def unit(self) -> str:
        """Of the quantity."""
        return QUANTITIES[self.quantity][0]

    @property
    def next(self) -> str:
        """What to record to see more of it."""
        return QUANTITIES[self.quantity][1]

    @property
    def where(self) -> str:
        """At which values of what it is largest, and what to record next, in words."""
        place = f"it is strongest at {self.quantity} {self.low:.4g} to {self.high:.4g} {self.unit}"
        if self.only_held_out:
            hidden = "and does not show in the fitted ones; record more like them to fit to"
            return f"{place} of the held-out recordings, {hidden}"
        return f"{place}; record {self.next}"

    def as_json(self) -> dict[str, Any]:
        """As `trace.json` has it."""
        return {"description": self.description, "where": self.where, "share_of_residual": self.share}


@dataclass(frozen=True)
class Quantity:
    """What the residual force may depend on. values (n,) : one per sample of all fitted recordings, in `unit`; next :
    what to record to see more of it.
    """

    values: Array
    unit: str
    next: str


def quantities(model: Model) -> dict[str, Quantity]:
    """What an engineer would plot the residual force over, by name."""
    parts = [_signals(grid.t, path) for grid, path in zip(model.data.fitted, model.estimate.paths, strict=True)]
    return {
        name: Quantity(np.concatenate([part[name] for part in parts]), *of) for name, of in QUANTITIES.items()
    }  # fmt: skip


def describe_residual(found: Selection) -> ResidualDescription:
    """Describe the residual force of the final model: on the fitted recordings or, where they show nothing, on those
    held out.
    """
    model = found.final.on_held_out() if found.only_held_out else found.final
    force = np.concatenate(model.residual_force)
    std = np.concatenate([s.force.std for s in model.data.fitted])
    share = float(np.clip((found.after.loss - 1.0) / max(found.before.loss - 1.0, 1e-9), 0.0, 1.0))
    z2, known = (force / std) ** 2, quantities(model)
    del known["direction"]  # two values make no range; the velocity has it too
    dependence = {name: _dependence(quantity.values, z2) for name, quantity in known.items()}
    name = max(dependence, key=lambda key: dependence[key][0])
    _, low, high = dependence[name]
    rms = float(np.sqrt(np.mean(force**2)))
    description = (
        f"a force of {rms:.3g} N rms beside the model's, {np.sqrt(z2.mean()):.2f} times its standard deviation"
    )
    return ResidualDescription(description, name, low, high, found.only_held_out, share)


def _signals(t: Array, path: Array) -> dict[str, Array]:
    """The quantities of one recording along its smoothed path."""
    x, v, u = path[:, 0], path[:, 1], path[:, -2]
    moving = _slides(v)
    direction = _last_nonzero(np.where(moving, np.sign(v), 0.0))
    reversal = _last_nonzero(np.where(np.append(True, np.diff(direction) != 0), t, 0.0))
    stopped = _last_nonzero(np.where(np.append(True, np.diff(moving.astype(int)) < 0), t, 0.0))
    rest = np.where(~moving, t - stopped, 0.0)
    started = np.append(False, np.diff(moving.astype(int)) > 0)
    last = _last_nonzero(np.where(started, np.append(0.0, rest[:-1]), 0.0))
    return {
        "position": x, "velocity": v, "direction": direction, "time": t, "time since reversal": t - reversal,
        "time at rest": np.where(moving, last, rest), "force": u,
    }  # fmt: skip


def _slides(v: Array) -> NDArray[np.bool_]:
    """Where velocities (n,) are those of a valve that moves: at rest friction holds any force."""
    return np.asarray(np.abs(v) > AT_REST * float(np.sqrt(np.mean(v**2))))


def _last_nonzero(values: Array) -> Array:
    """Values (n,) with zeros replaced by the last that was not zero."""
    place = np.maximum.accumulate(np.where(values != 0, np.arange(len(values)), 0))
    return np.asarray(values[place], float)


def _dependence(values: Array, z2: Array) -> tuple[float, float, float]:
    """How much the residual varies with a quantity: relative spread of its mean square over equally filled bins, and
    the limits of the bin where it is largest.
    """
    bins = BINS
    edges = np.quantile(values, np.linspace(0, 1, bins + 1))
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, bins - 1)
    count = np.maximum(np.bincount(place, minlength=bins), 1)
    mean = np.bincount(place, z2, minlength=bins) / count
    top = int(np.argmax(mean))
    return float(np.std(mean) / max(mean.mean(), 1e-12)), float(edges[top]), float(edges[top + 1])
