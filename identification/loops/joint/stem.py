"""A LuGre stem without a positioner, from one controller output to the next: the valve of the joint inference.

Within a sample OP is held, and the stem is at rest long before the next one. So every sample is given `HELD` seconds of
the compiled physics, whatever its length.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from recordings import Array
from simulator import BASE, Kernel, kernel

HELD, SUB_STEP = 0.15, 5e-3
"""Time of the physics for a sample, and its steps [s]: they resolve the slip of a stem on its spring."""


def stem_kernel() -> Kernel:
    """The physics of the base effects, in the order for steps that do not resolve the bristle."""
    return kernel(BASE, damped=True)


def stem_path(values: Mapping[str, float], force: Array, way: float) -> Array | None:
    """Positions (n,) [m] at the ends of samples under the forces (n,) [N]; None where they do not stay finite.

    way : 1 or -1, the direction in which the stem has moved before it stopped under the first force.
    """
    valve = stem_kernel()
    t = HELD * np.arange(len(force) + 1.0)
    rest = (force[0] - values["spring.F0"] - way * values["lugre.fc"]) / values["spring.K"]
    driven = np.concatenate([force, force[-1:]])
    found = valve.run(
        t, driven, valve.vector(values), valve.start(rest, force=force[0]), h_max=SUB_STEP, hold=True
    ).outputs[1:, 0]
    return found if np.isfinite(found).all() else None


@dataclass
class LugreStem:
    """The same stepped sample by sample: `move(op)` gives the position in % of the stroke for OP in % about its middle.

    values : of the base effects; full : force of the whole range of OP [N].
    """

    values: Mapping[str, float]
    full: float
    _state: Array | None = field(default=None, repr=False)

    def move(self, op: float) -> float:
        """The position for the next controller output."""
        valve = stem_kernel()
        force = np.full(2, self.full * op / 100)
        state = valve.start(force=force[0]) if self._state is None else self._state
        p = valve.vector(self.values)
        self._state = valve.run(np.array([0.0, HELD]), force, p, state, h_max=SUB_STEP / 4, hold=True).final
        return 100 * self.values["spring.K"] * float(self._state[0]) / self.full
