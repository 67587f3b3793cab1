"""What moves the valve of the demo while it is watched: plant time follows the clock only as far as the monitor does.

How soon an alarm comes, in the valve's time, therefore does not depend on the speed of the machine.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from bristle.cli.demo.valve import MOVE_S, STEP_S, Averaged, moved
from hil import LiveSource

AHEAD_S = 1.0
"""Plant time that may have passed without being watched yet [s]; the ring of the valve holds five times as much."""

ALIVE_S = 1.0
"""Seconds of the clock after which the valve is moved on all the same: the link takes it for dead otherwise."""

LOOK_S = 0.005
"""Seconds of the clock between two looks at how far the monitor is."""


class DemoDrive:
    """A valve that follows a set point over plant time [s], in lock-step.

    plant : where set points are written; source : what the monitor reads; speed : times real time, at most; seconds :
    plant time that has passed since the monitor's first sample.
    """

    def __init__(self, plant: LiveSource, source: Averaged, setpoint: Callable[[float], float], speed: float) -> None:
        self._plant, self._source, self._setpoint, self._speed = plant, source, setpoint, speed
        self.seconds = 0.0

    async def run(self) -> None:
        """Move the valve until cancelled. Raises what ends the link."""
        clock = asyncio.get_running_loop().time
        while self._source.taken == 0:  # time stands still until the monitor is there
            await asyncio.sleep(LOOK_S)
        due = clock()
        while True:
            await moved(self._plant, lambda t: self._setpoint(self.seconds + t), MOVE_S)
            self.seconds += MOVE_S
            due = max(due + MOVE_S / self._speed, clock())
            await asyncio.sleep(due - clock())
            while self._unwatched_s > AHEAD_S and clock() < due + ALIVE_S:
                await asyncio.sleep(LOOK_S)

    @property
    def _unwatched_s(self) -> float:
        return self.seconds - self._source.taken * STEP_S
