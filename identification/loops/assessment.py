"""What was found of a loop: the content of `assessment.json`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identification.loops.amounts import StictionAmount
from identification.loops.data_problems import DataProblem
from identification.loops.forces import WITHOUT_POSITIONER, FrictionForces
from identification.loops.joint import JointPosterior
from identification.loops.loop import ControlLoop
from identification.loops.methods import MethodAnswer
from identification.loops.oscillation import Oscillation
from identification.loops.verdict import LoopVerdict
from identification.shown_findings import ShownFindings
from recordings import Array, ReportOpening, save_json

if TYPE_CHECKING:
    from identification.report.findings_page import Findings


@dataclass(frozen=True)
class OtherCause:
    """What else it would be. evidence : what speaks for it most, in words."""

    probability: float
    evidence: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class Assessment(ShownFindings):
    """The assessment of a loop.

    verdict; probability : of stiction, None where the data cannot carry one; why : in a sentence; amount : S
    and J where there is stiction; other_causes : by name; guesses : what was not said of the
    columns; loop : what was assessed; forces, joint : friction in N, and valve and process together, where there is
    stiction and the valve's data are known.
    """

    verdict: LoopVerdict
    probability: float | None
    why: str
    loop: ControlLoop
    problems: tuple[DataProblem, ...]
    guesses: tuple[str, ...]
    oscillations: tuple[Oscillation, ...]
    amount: StictionAmount | None
    other_causes: Mapping[str, OtherCause]
    answers: tuple[MethodAnswer, ...]
    forces: FrictionForces | None = None
    joint: JointPosterior | None = None

    def as_json(self) -> dict[str, Any]:
        """The content of `assessment.json`."""
        n, dt = len(self.loop.pv), self.loop.dt
        cycles = n * dt / self.oscillations[0].period_s if self.oscillations else 0.0
        problems = [*(one.words for one in self.problems), *self.guesses]
        amount = self.amount
        stiction: dict[str, Any] | None = (
            {"S_percent": amount.s.as_json(), "J_percent": amount.j.as_json()} if amount else None
        )
        if stiction and self.forces:
            stiction |= {"fs_N": self.forces.fs.as_json(), "fc_N": self.forces.fc.as_json()}
        if stiction and self.joint:
            stiction["joint"] = self.joint.as_json()
        return {
            "format": "loop-assessment", "version": 1, "verdict": self.verdict, "probability": self.probability,
            "why": self.why, "data": {"samples": n, "dt_s": dt, "cycles": cycles, "problems": problems},
            "oscillation": [{"period_s": one.period_s, "regularity": one.regularity} for one in self.oscillations],
            "stiction": stiction,
            "other_causes": [
                {"cause": name, "probability": one.probability, "evidence": list(one.evidence)}
                for name, one in self.other_causes.items()
            ],
            "methods": [
                {"method": one.method, "value": one.value, "says": one.says, "why": one.why} for one in self.answers
            ],
        }  # fmt: skip

    def lines(self) -> list[str]:
        """The answer in lines for a terminal."""
        likely = "" if self.probability is None else f", probability of stiction {self.probability:.2f}"
        found = [f"{self.verdict}{likely}: {self.why}"]
        found += [f"oscillation: period {o.period_s:.4g} s, regularity {o.regularity:.3g}" for o in self.oscillations]
        if self.amount:
            for name, one in (("S", self.amount.s), ("J", self.amount.j)):
                found.append(f"{name} = {one.value:.3g} % ({one.lower:.3g} to {one.upper:.3g} %)")
        if self.forces:
            for name, one in (("fs", self.forces.fs), ("fc", self.forces.fc)):
                found.append(f"{name} = {one.value:.3g} N ({one.lower:.3g} to {one.upper:.3g} N)")
            found.append(WITHOUT_POSITIONER)
        found += self.joint.lines() if self.joint else []
        if self.other_causes:
            found.append("else: " + ", ".join(f"{n} {one.probability:.2f}" for n, one in self.other_causes.items()))
            likely, other = next(iter(self.other_causes.items()))
            found += [f"for {likely}: {', '.join(other.evidence)}"] if other.evidence else []
        return [*found, *(one.words for one in self.problems), *self.guesses]

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `assessment.json`, all or nothing. Raises BadInput when it cannot be written."""
        save_json(Path(path), self.as_json())

    def findings(self) -> Findings:
        """What its page shows."""
        import numpy as np

        from identification.report.findings_page import Findings

        rows = [(o.method, "" if o.value is None else f"{o.value:.3g}", o.says, o.why) for o in self.answers]
        t = np.arange(float(len(self.loop.pv))) * self.loop.dt
        over_time = [] if self.loop.sp is None else [("SP", t, self.loop.sp)]
        over_time.append(("PV", t, self.loop.pv))
        curves: dict[str, tuple[str, str, list[tuple[str, Array, Array]]]] = {
            "Process value": ("time [s]", "PV", over_time),
            "Controller output": ("time [s]", "OP", [("OP", t, self.loop.op)]),
            "PV against OP": ("OP", "PV", [("loop", self.loop.op, self.loop.pv)]),
        }
        table = (("method", "value", "says", "why"), rows)
        lines = tuple(self.lines())
        heading = f"Control loop {Path(self.loop.name).name}"
        return Findings(heading, "Control loop", lines, (table,), curves, self._opening())

    def _opening(self) -> ReportOpening:
        """What the page opens with."""
        sure = (
            "the data cannot carry one"
            if self.probability is None
            else f"probability of stiction {self.probability:.2f}"
        )
        if self.verdict == "stiction":
            size = "" if self.amount is None else f", S = {self.amount.s.value:.2g} % of the range"
            action = (
                "put the loop in manual and step the output to confirm; then service packing, actuator and positioner"
            )
            return ReportOpening("repair", f"the valve sticks{size}", sure, action)
        likely = next(iter(self.other_causes), None)
        if self.verdict == "no_stiction":
            action = f"look for {likely} instead" if likely else "nothing"
            return ReportOpening(
                "watch" if likely else "good", "the valve does not stick as far as these data show", sure, action
            )
        action = "record longer at full rate, without compression, while the loop oscillates"
        return ReportOpening("watch", f"these data cannot tell: {self.why}", sure, action)
