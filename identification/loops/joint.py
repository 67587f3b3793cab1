"""Valve and process together: what OP and PV say of a LuGre stem on its spring and of the process behind it.

Within a sample the stem slips and rests, so of a LuGre model OP and PV show where it breaks away, fs, and where a slip
ends, fc; mass, bristle and the curve between both friction levels act within the slip. The posterior of fs, fc and the
gain of the process is drawn as in `amounts`: from the errors in the stems of the calibration, whose valve and process
were known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from identification.loops.amounts import PossibleValves
from identification.loops.calibration import STEM_ERRORS
from identification.loops.forces import FrictionForces
from identification.loops.loop import ControlLoop, scale_of
from identification.loops.methods import HammersteinFit
from identification.standard_tests import Interval
from recordings import Array

WIDEST = 1.0
"""Half width of an interval, as a share of its value, from which on a quantity is not told."""
UNTOLD = ("mass", "Stribeck velocity", "viscous friction", "bristle stiffness", "bristle damping")
WITHIN = f"{', '.join(UNTOLD)}: not told, as they act within a slip, and that is over between two samples"

ROUGH = f"rough intervals: they rest on the errors in {len(STEM_ERRORS)} simulated stems"


@dataclass(frozen=True)
class JointPosterior:
    """Valve and process. values : 95 % intervals of fs_N, fc_N and process_gain (PV per % of travel), as far as
    told; correlation : of each pair; open : which are not told; refused : why there is no posterior at all.
    """

    values: Mapping[str, Interval]
    correlation: Mapping[tuple[str, str], float]
    open: tuple[str, ...] = ()
    refused: str | None = None

    def as_json(self) -> dict[str, object]:
        """The part `joint` of `assessment.json`."""
        if self.refused:
            return {"refused": self.refused}
        correlations = [{"of": list(pair), "value": value} for pair, value in self.correlation.items()]
        values = {name: one.as_json() for name, one in self.values.items()}
        return {**values, "correlations": correlations, "not_told": [*self.open, *UNTOLD]}

    def lines(self) -> list[str]:
        """In lines for a terminal."""
        if self.refused:
            return [f"no joint posterior of valve and process: {self.refused}"]
        told = [f"{name} {one.value:.3g} ({one.lower:.3g} to {one.upper:.3g})" for name, one in self.values.items()]
        wide = f"{', '.join(self.open)}: open by more than their size; " if self.open else ""
        return [f"valve and process together: {', '.join(told)}", ROUGH, wide + WITHIN]


def joint_posterior(
    loop: ControlLoop, period: float | None, best: tuple[float, float], possible: PossibleValves, forces: FrictionForces
) -> JointPosterior:
    """The posterior for a loop whose valve sticks. best : the pair S, J that was found; possible : stems in which that
    is found; forces : their friction.
    """
    if loop.integrating:
        return _refused("a level has no gain at rest; fs and fc stand by themselves")
    gain = process_gain(loop, period, *best) * possible.gain
    drawn = {"fs_N": possible.s + possible.j, "fc_N": possible.s - possible.j, "process_gain": gain}
    values = {"fs_N": forces.fs, "fc_N": forces.fc, "process_gain": possible.interval(gain, possible.median(gain))}
    told = {name: one for name, one in values.items() if one.upper - one.lower <= 2 * WIDEST * one.value}
    if not told:
        return _refused(f"these data leave {', '.join(values)} open by more than their size")
    wide = tuple(name for name in values if name not in told)
    return JointPosterior(told, _correlations({name: drawn[name] for name in told}, possible.weight), wide)


def process_gain(loop: ControlLoop, period: float | None, s: float, j: float) -> float:
    """PV over the travel of a valve with S and J, at rest, in their units."""
    fit = HammersteinFit.of(loop, period)
    scale = scale_of(loop.pv[: len(fit.op)]) / scale_of(fit.op)
    return fit.process.static_gain(fit.course(s, j)) * scale


def _refused(why: str) -> JointPosterior:
    return JointPosterior({}, {}, refused=why)


def _correlations(drawn: Mapping[str, Array], weight: Array) -> dict[tuple[str, str], float]:
    known = np.isfinite(np.sum(list(drawn.values()), axis=0))
    names, values = list(drawn), np.array(list(drawn.values()))[:, known]
    covariance = np.atleast_2d(np.cov(values, aweights=weight[known]))
    spread = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return {
        (names[a], names[b]): float(covariance[a, b] / spread[a] / spread[b])
        for a, b in combinations(range(len(names)), 2)
    }
