"""Force of the flow on the plug, along the stroke."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Parameter, Quantities, Site, Values
from simulator.first_look import FirstLook, Trial, local_shapes


class FlowForce(Effect):
    """F = f / (1 + ((x - x0)/w)^2): pressure drop times unbalanced area, or the dip of the vena contracta.

    For a plug of linear characteristic in series with a pipe the drop over the plug is dp / (1 + (x/w)^2), x0 = 0 being
    the seat and w the opening that takes half of it; elsewhere it is a hump of half width w at x0. f < 0 pulls the plug
    towards larger x.
    """

    id = "flow_force"
    site = Site.FORCE
    sentence = "the flow pushes on the plug, and how hard depends on the opening"
    check = "the pressure drop during the recording, the flow direction and the balance of the plug"
    parameters = (
        Parameter("f", "N", "largest force of the flow against rising position", scale=60.0, neutral=0.0),
        Parameter("x0", "m", "position of the largest force", scale=0.008),
        Parameter("w", "m", "distance at which half of it is left", 0.006, lower=0.0, positive=True),
    )

    def force(self, q: Quantities, p: Values, s: Values, ds: Values) -> Expression:
        return p["f"] / (1 + ((q.x - p["x0"]) / p["w"]) ** 2)

    def first_guess(self, recordings: Sequence[FirstLook], base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """The humps along the stroke that explain most of what is missing, and at which the measurements pull most."""

        def trial(x0: float, w: float) -> Trial:
            return {"x0": x0, "w": w}, {"f": lambda r: 1 / (1 + ((r.x - x0) / w) ** 2)}

        trials = [trial(*shape) for shape in local_shapes(recordings)]
        return self.guessed_shapes(recordings, base, trials, "spring.K", "spring.F0")
