"""Section 4.4: a friction and a spring fault at 60 s, and when each is seen. Run: python -m studies.section44"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detector import Decisions, ObserverState
from detector.published import section_4_4
from detector.theory import Condition, detectability, detection_bound
from studies import drawing
from studies.plant import A1_TRUE, ONSET, FaultName, Run, learned, model_error, simulate

PUBLISHED: dict[FaultName, float] = {"friction": 0.0076, "spring": 0.0209}
"""Detection times of the source [s]."""


@dataclass(frozen=True)
class Detection:
    """What becomes of one fault. holds_s, crosses_s : seconds after the onset, None for never; bound_s : (4.35)."""

    run: Run
    decisions: Decisions
    condition: Condition
    holds_s: float | None
    crosses_s: float | None
    bound_s: float


def detect(before: Run, state: ObserverState, fault: FaultName, *, k2: float = 200.0, length: float = 0.2) -> Detection:
    """A fault from where the healthy run ended, sampled at 10 us."""
    observer = section_4_4(k2)
    run = simulate(ONSET, ONSET + length, 1e-5, fault, before.final)[1:]
    _, decisions = observer.run(state, *run.samples, history=True)
    a = model_error(run, decisions, observer)
    condition = detectability(run.t, a, run.b, decisions.rho, k2=k2, alpha1=A1_TRUE)
    holds, crosses = (None if t is None else t - ONSET for t in (condition.holds_s, decisions.first_alarm()))
    return Detection(run, decisions, condition, holds, crosses, _bound(run, a, decisions, k2))


def _bound(run: Run, a: NDArray[np.float64], decisions: Decisions, k2: float) -> float:
    """(4.35) with the sizes met until the time it returns: the least over windows in which its conditions hold."""
    bounds = [np.inf]
    for window in np.arange(0.001, run.t[-1] - ONSET, 0.001):
        near = run.t <= ONSET + window
        least, most = float(np.abs(run.b[near]).min()), float(np.abs(a[near]).max())
        phi = float(decisions.phi[near].max())
        bound = detection_bound(b_least=least, a_most=most, phi=phi, k2=k2, alpha1=A1_TRUE)
        if bound <= window:
            bounds.append(bound)
    return min(bounds)


def seconds(value: float | None) -> str:
    """A time for a table."""
    return "never" if value is None or not np.isfinite(value) else f"{value:.5f}"


def main() -> None:
    """Write docs/studies/section44.md and .svg."""
    before, state, healthy = learned(section_4_4())
    found = {fault: detect(before, state, fault) for fault in PUBLISHED}
    rows = [
        [name, f"{PUBLISHED[name]:.4f}", seconds(one.holds_s), seconds(one.crosses_s), seconds(one.bound_s)]
        for name, one in found.items()
    ]
    head = ["fault", "published [s]", "(4.32) holds [s]", "residual crosses [s]", "bound (4.35), corrected [s]"]
    seen = f"{int(healthy.exceeded.sum())} of {len(healthy)}"
    note = "The crossing comes first: (4.32) is a sufficient condition, and (4.35) promises nothing at these sizes.\n"
    note += f"Samples above the threshold from 0 to 60 s, without a fault: {seen}."
    print(drawing.table("section44", "Section 4.4: detection times after the onset", head, rows, note))
    _draw(found)


def _draw(found: dict[FaultName, Detection]) -> None:
    figure, axes = drawing.axes(2, 2, (7.5, 4.2))
    for (name, one), (above, below) in zip(found.items(), axes.T, strict=True):
        near = one.run.t <= ONSET + 0.04
        ms = 1e3 * (one.run.t[near] - ONSET)
        curves = ((np.abs(one.decisions.xi2), "C3", "|ξ₂|"), (one.decisions.rho, "0.3", "ρ"))
        for values, colour, label in curves:
            above.plot(*drawing.envelope(ms, 1e3 * values[near], 200), colour, label=label)
        below.plot(*drawing.envelope(ms, 1e3 * one.condition.margin[near], 200), "C0", label="margin of (4.32)")
        below.axhline(0.0, color="0.6", lw=0.6)
        for axis in (above, below):
            axis.axvline(1e3 * PUBLISHED[name], color="C2", ls=":", label="published")
            axis.legend(frameon=False)
        above.set(title=f"{name} fault at 60 s", ylabel="velocity [mm/s]")
        below.set(xlabel="time after the onset [ms]", ylabel="velocity [mm/s]")
    drawing.save(figure, "section44")


if __name__ == "__main__":
    main()
