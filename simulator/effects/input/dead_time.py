"""The actuating force acts later than it was recorded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.delay import LONGEST
from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook
from simulator.imitation import late, shifted


class DeadTime(Effect):
    """u(t) -> u(t - tau): a pure delay, as of a bus, a sampled positioner or a wave in a long signal line.

    The kernel has no history of its own, and a chain of lags would round the corners of the force, which are what shows
    a delay. So the kernel looks the delayed force up in the recording (`simulator/delay.py`) and hands its difference
    to the force of now over as `q.late`, with du/dt as its derivative by tau: exact at the samples up to the
    interpolation between them, and what else acts on the force, such as an estimated error of it, stays as it is.
    A delay of the input and one of the output look alike but for effects that know the time.
    """

    id = "dead_time"
    site = Site.INPUT
    sentence = "the actuating force acts some time after it was recorded"
    check = "clocks and sampling of the channels, bus cycles of the positioner and the length of signal lines"
    imitated = True
    parameters = (Parameter("tau", "s", "dead time", scale=5e-3, lower=0.0, upper=LONGEST, neutral=0.0),)
    delay = "tau"

    def input(self, q: Quantities, p: Values, s: Values) -> Expression:
        return q.u + q.late

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The delay of the force with which the loop of force over motion is closest."""
        return late(self.parameter_name("tau"), recordings, base, shifted)
