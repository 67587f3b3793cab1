"""Play between stem and position sensor (equation 2.36)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from simulator.effect import Effect, Expression, Memory, Parameter, Quantities, Site, TriedAt, Values
from simulator.play import play


class PositionBacklash(Effect):
    """y -> w, which the stem drags along at either end of a gap: (2.36) with m = 1 and crossings cr = -cl = width/2."""

    id = "backlash"
    site = Site.OUTPUT
    sentence = "there is play between stem and position sensor, so the reading stands still after a reversal"
    check = "feedback linkage, pins and couplings between stem and position sensor for play"
    parameters = (
        Parameter("width", "m", "width of the play", scale=2e-4, lower=0.0, neutral=0.0, tried_at=TriedAt.NOISE),
    )
    memory = (Memory("w", "m", at_position=True),)

    def jump(self, q: Quantities, p: Values, s: Values) -> Mapping[str, Expression]:
        return {"w": play(s["w"], q.y, p["width"])}

    def output(self, q: Quantities, p: Values, s: Values) -> Expression:
        return s["w"]

    def imitated(self, base: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
        """A play hides the bristles: without it they look stiffer, and the friction curve flatter."""
        if base["spring.K"] <= 0:
            return []
        way, found = base["lugre.fc"] / base["spring.K"], list[Mapping[str, float]]()
        for share, softer in itertools.product((0.03, 0.1), (1.0, 0.1)):
            sigma0 = softer * base["lugre.sigma0"]
            found.append({
                self.parameter_name("width"): share * way, "lugre.sigma0": sigma0, "lugre.vs": 3e-3,
                "lugre.sigma1": 0.6 * (sigma0 * base["mass.m"]) ** 0.5, "lugre.fs": 1.4 * base["lugre.fc"],
            })  # fmt: skip
        return found
