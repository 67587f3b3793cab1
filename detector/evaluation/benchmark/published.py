"""What others published on the benchmark, to stand beside our table.

`damadics.md`, section 5, as read in the papers: methods, data and noise differ from ours, so these are anchors, no
race. R2: Mrugalski, Arinton & Korbicz (2003), dynamic GMDH networks; P1: Papadimitropoulos, Rovithakis & Parisini
(2003), the observer of Chapter 5; R1: Patan & Parisini (2003); R3: Rzepiejewski, Syfert & Jegorov (2003); R4: Almeida &
Park (2008); R5: Bahrampour, Moshiri & Salahshoor (2011); R6: self-organising map, IJSCE (2011).
"""

from __future__ import annotations

from simulator.damadics import SCENARIOS

_MISSED = ("f5-", "f9-", "f12-", "f14-", "f8-abrupt-small", "f8-abrupt-medium", "f16-abrupt-small", "f16-abrupt-medium")
_BLANK = ("f10-abrupt-small",)

R2 = {
    name: "" if name in _BLANK else "no" if name.startswith(_MISSED) else "yes"
    for name, scenario in SCENARIOS.items()
    if scenario.benchmark
}
"""Whether R2 detects each of the 44 scenarios through X or F; blank where the paper leaves the cell empty."""

OTHERS = (
    ("P1", "HONN approximator (source, Chapter 5)", "simulator, no noise", "f4 11.12 s after its onset; f11 0.005 s"),
    ("R1", "dynamic neural network, threshold 0.05", "plant, actuator 1",
     "residual F: f16 7 s, f17 2 s, f18 75 s (rfd .092, .263, .326; rtd .953, .998, .93)"),
    ("R2", "dynamic GMDH", "simulator", f"{sum(v == 'yes' for v in R2.values())} of 44 scenarios by X or F"),
    ("R3", "neural network and fuzzy logic", "simulator and plant", "f11 not detectable without Ps"),
    ("R4", "hidden Markov models", "simulator", "abrupt f16, f17, f18 at once; incipient f17 at 5.6 % strength"),
    ("R5", "possibilistic C-means", "plant, f16 to f19", "20 s after onset; 10 false positives in 500"),
    ("R6", "self-organising map", "simulator, f1 to f3", "f1 clear; f2 and f3 overlap"),
)  # fmt: skip
"""Others: id, method, data, result."""
