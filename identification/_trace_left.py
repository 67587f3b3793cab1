"""What is left when tracing ends: how big, where, and what to measure next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification._trace import Tracing

Array = NDArray[np.float64]

BINS = 12


@dataclass(frozen=True)
class Remainder:
    """A description of what no candidate explains. share : of the residual's square over the noise that is left."""

    description: str
    where: str
    share: float

    def as_json(self) -> dict[str, Any]:
        """As `trace.json` has it."""
        return {"description": self.description, "where": self.where, "share_of_residual": self.share}


def remainder(found: Tracing) -> Remainder:
    """Describe what is left of the force behind the final model, on the fitted recordings."""
    model = found.final
    force = np.concatenate(model.force_left)
    std = np.concatenate([s.force.std for s in model.bench.fitted])
    path = np.concatenate([p[:, :2] for p in model.estimate.paths])
    clock = np.concatenate([s.t for s in model.bench.fitted])
    share = float(np.clip((found.after.loss - 1.0) / max(found.before.loss - 1.0, 1e-9), 0.0, 1.0))
    z2 = (force / std) ** 2
    quantities = {"position": (path[:, 0], "m"), "velocity": (path[:, 1], "m/s"), "time": (clock, "s")}
    dependence = {name: _dependence(values, z2) for name, (values, _) in quantities.items()}
    name = max(dependence, key=lambda key: dependence[key][0])
    _, low, high = dependence[name]
    unit = quantities[name][1]
    rms = float(np.sqrt(np.mean(force**2)))
    description = (
        f"a force of {rms:.3g} N rms beside the model's, {np.sqrt(z2.mean()):.2f} times its standard deviation"
    )
    where = (
        f"it is strongest at {name} {low:.4g} to {high:.4g} {unit}; record slow sweeps through that range in both "
        "directions and at two speeds"
    )
    return Remainder(description, where, share)


def _dependence(values: Array, z2: Array) -> tuple[float, float, float]:
    """How much what is left varies with a quantity: relative spread of its mean square over equally filled bins, and
    the bin where it is largest."""
    edges = np.quantile(values, np.linspace(0, 1, BINS + 1))
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, BINS - 1)
    count = np.maximum(np.bincount(place, minlength=BINS), 1)
    mean = np.bincount(place, z2, minlength=BINS) / count
    top = int(np.argmax(mean))
    return float(np.std(mean) / max(mean.mean(), 1e-12)), float(edges[top]), float(edges[top + 1])
