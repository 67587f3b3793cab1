"""What does the model lack? Trace an effect that the model does not have.

    python examples/trace_effect.py [FOLDER]

The spring of the valve becomes stiffer with travel: it has a cubic part. The fitted model of friction and a linear
spring does not know that. A trace finds the effect, adds it, and judges it on data that were held out.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bristle as br

CUBIC = 3e6
"""Cubic part of the spring [N/m3]."""


def main(folder: Path) -> None:
    """Simulate a valve with a hardening spring, trace it, and write answer, model and report to a folder."""
    first, second, judging = (
        br.simulate(
            course, effects=["hardening_spring"], given={"hardening_spring.k3": CUBIC}, rate=250, seed=3,
            position_noise=5e-6, force_noise=1.0,
        )
        for course in ("staircase:14", "sine:14", "multisine:12")
    )  # fmt: skip

    found = br.trace([first, second], holdout=judging, progress=print_stage)
    print(found)
    for sentence in found.sentences():
        print(sentence)
    if "hardening_spring.k3" in found.values:
        print(f"cubic part: {found.values['hardening_spring.k3']:.3g} N/m3; it was simulated with {CUBIC:.3g}")

    found.write(folder / "trace.json")
    found.model.write(folder / "traced.json")
    found.report(folder / "trace.html")
    print(f"wrote trace.json, traced.json and trace.html to {folder}")


def print_stage(stage: str, done: int, total: int) -> None:
    """Show what is being done."""
    print(f"  {stage} {done}/{total}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
