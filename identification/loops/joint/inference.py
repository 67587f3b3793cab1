"""LuGre and process together from OP and PV: a posterior where the data carry it, and a refusal where not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.loops.joint.chain import Place, chain, scale_reduction
from identification.loops.joint.series import TAU, JointSeries
from identification.loops.loop import ControlLoop
from identification.loops.methods import StictionSearch
from identification.standard_tests import Interval
from recordings import Array

LONGEST = 2500
"""Samples that are used: the first ones."""
CHAINS, MOVES, STARTS = 3, 400, 24
MOST_REDUCTION = 1.15
"""Scale reduction above which the chains have not met."""
TOLD = 0.5
"""Share of the width of its prior, on a logarithmic scale, below which the interval of an unknown counts as told."""
SURE = ("fc", "fs")
"""Without these there is no posterior worth the name."""


@dataclass(frozen=True)
class JointPosterior:
    """Of valve and process together. told : by name with unit, 95 % intervals; untold : of what the data say no more
    than was assumed before; correlation : of the logarithms of fc and fs, and of fc and the gain; draws (n, k) : by
    `names`; refused : why there is none, in a sentence, else empty.
    """

    told: Mapping[str, Interval]
    untold: tuple[str, ...]
    names: tuple[str, ...]
    draws: Array
    refused: str = ""

    def as_json(self) -> dict[str, Any]:
        """As `assessment.json` has it."""
        if self.refused:
            return {"refused": self.refused}
        matrix = np.corrcoef(self.draws.T)
        return {
            "told": {name: one.as_json() for name, one in self.told.items()}, "not_told": list(self.untold),
            "names": list(self.names), "correlation": [[float(one) for one in row] for row in matrix],
        }  # fmt: skip

    def lines(self) -> list[str]:
        """The answer in lines for a terminal."""
        if self.refused:
            return [f"no joint posterior of valve and process: {self.refused}"]
        found = [f"{name} = {one.value:.3g} ({one.lower:.3g} to {one.upper:.3g})" for name, one in self.told.items()]
        return [*found, f"not told by the data: {', '.join(self.untold) or 'nothing'}"]


def refused(why: str) -> JointPosterior:
    """The answer where there is no posterior."""
    return JointPosterior({}, (), (), np.empty((0, 0)), why)


def joint_inference(
    loop: ControlLoop, found: StictionSearch, K: float, full: float, seed: int = 0, moves: int = MOVES
) -> JointPosterior:
    """The posterior of a LuGre stem without a positioner in series with the loop's process.

    found : the search, which has starting values; K [N/m], full [N] : spring rate, force of the whole range of OP.
    """
    rng = np.random.default_rng([seed, 31])
    first = max(start for start, _ in found.starts)
    series = [JointSeries.of(_first(loop), K, full, start, first, way) for start, way in found.starts]
    places = sorted((one for each in series for one in _starts(each, found)), key=lambda one: -one[1].density)
    if len(places) < CHAINS:
        return refused("no stem within the range of plausible valves follows these data")
    chosen = places[0][0]
    best = [place for which, place in places if which is chosen][:CHAINS]
    best += [best[0]] * (CHAINS - len(best))
    chains = [chain(chosen, start, moves, rng) for start in best]
    draws = np.array([[_draw(chosen, one, rng) for one in places] for places in chains])
    names = _names(loop)
    return _answer(chosen, draws, names)


def _first(loop: ControlLoop) -> ControlLoop:
    return replace(loop, op=loop.op[:LONGEST], pv=loop.pv[:LONGEST])


def _starts(series: JointSeries, found: StictionSearch) -> list[tuple[JointSeries, Place]]:
    """The best pairs of the search as places, each with the process that fits it best."""
    order = np.argsort(found.error)
    places, seen = [], []
    for i in order:
        s, j = float(found.s[i]), float(found.j[i])
        excess = float(np.clip((s + j) / max(s - j, 1e-3 * s) - 1, 0.12, 2.8))
        sizes = (np.log(s), np.log(excess))
        if any(abs(sizes[0] - one[0]) < 0.01 and abs(sizes[1] - one[1]) < 0.1 for one in seen):
            continue
        seen.append(sizes)
        fc = s * series.full / 100 / (2 + excess)
        valve = np.log([fc, excess, 300.0, 3e-3, 3.0])
        path = series.path(valve)
        if path is not None and np.ptp(path) > 0:
            places.append((series, _best_process(series, valve, path)))
        if len(seen) >= STARTS // 2:
            break
    return places


def _best_process(series: JointSeries, valve: Array, path: Array) -> Place:
    """The best of a grid of time constants, delays and noises."""
    taus = (1.0,) if series.integrating else (0.7, 1.5, 3.0, 6.0, 12.0, 25.0, 60.0)
    grid = [
        (np.array([np.log(tau), np.arctanh(0.95), np.arctanh(zero)]), delay)
        for tau in taus for delay in range(0, 13) for zero in (0.3, 0.8)
    ]  # fmt: skip
    densities = [series.density(path, process, delay) for process, delay in grid]
    process, delay = grid[int(np.argmax(densities))]
    return Place(valve, process, delay, path, max(densities))


def _names(loop: ControlLoop) -> tuple[str, ...]:
    rate = "gain [PV per s and % of travel]" if loop.integrating else "gain [PV per % of travel]"
    return ("fc [N]", "fs [N]", "sigma2 [N s/m]", "vs [m/s]", "mass [kg]", rate, "time constant [samples]",
            "delay [samples]")  # fmt: skip


def _draw(series: JointSeries, place: Place, rng: np.random.Generator) -> list[float]:
    fc, excess, sigma2, vs, mass = map(float, np.exp(place.valve))
    gain = series.gain(place.path, place.process, place.delay, rng)
    tau = float(np.exp(place.process[0]))
    return [fc, fc * (1 + excess), sigma2, vs, mass, gain, tau, float(place.delay)]


def _answer(series: JointSeries, draws: Array, names: tuple[str, ...]) -> JointPosterior:
    """Told is what has a narrow interval beside its prior. draws (chains, n, k)."""
    logs = np.log(np.maximum(np.abs(draws[:, :, :2]), 1e-300))
    reduction = scale_reduction(logs)
    flat = draws.reshape(-1, draws.shape[2])
    if reduction > MOST_REDUCTION:
        return refused(f"chains from several starts do not agree on the friction (scale reduction {reduction:.2f})")
    ranges = series.ranges()
    priors = {
        "fc": ranges["fc"], "fs": (ranges["fc"][0] * 1.1, ranges["fc"][1] * 4.0), "sigma2": ranges["sigma2"],
        "vs": ranges["vs"], "mass": ranges["mass"], "time": TAU,
    }  # fmt: skip
    told, untold = {}, []
    for k, name in enumerate(names):
        if series.integrating and name.startswith("time"):
            continue
        low, middle, high = (float(one) for one in np.quantile(flat[:, k], (0.025, 0.5, 0.975)))
        prior = priors.get(name.split(" ")[0])
        narrow = low * high > 0 if prior is None else np.log(high / low) < TOLD * 0.95 * np.log(prior[1] / prior[0])
        if narrow or name.startswith("delay"):
            told[name] = Interval(middle, low, high)
        else:
            untold.append(name)
    missing = [name for name in untold if name.split(" ")[0] in SURE]
    if missing or any(name.startswith("gain") for name in untold):
        return refused(f"the data do not tell {', '.join(missing) or 'the gain of the process'}")
    return JointPosterior(told, tuple(untold), names, flat)
