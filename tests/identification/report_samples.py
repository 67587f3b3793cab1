"""What the tests of the report are made from: short recordings of simulated valves, and texts meant to break a page."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import traced_valves

from identification import Trace, Trajectory
from identification.tracing.models.comparison import Whiteness
from identification.tracing.residual import describe_residual
from recordings import Recording
from simulator import Excitation, Sensors, random_valve, simulate

HOSTILE_TITLE = "mixed <script>alert(1)</script> $$x$$ {{ 7 * 7 }}"
HOSTILE_TAG = 'LC74 "><img src=x onerror=alert(2)>'
SPIKE = 0.9
"""Position of the one outlying sample of a long run [m]."""


def recorded(excitation: str, *, valve: int = 4, seed: int = 1, rate: float = 250.0, **sensors: float) -> Recording:
    """A simulated recording of a seeded valve."""
    values, stroke = random_valve(valve)
    seen = Sensors(rate, **({"position_noise": 3e-6} | sensors))
    return simulate(values, Excitation.parse(excitation), seen, stroke=stroke, seed=seed)[0]


def long_run(one: Trajectory, samples: int = 200_000) -> Trajectory:
    """A run stretched to many samples, with one outlying and one missing sample."""

    def stretched(values: np.ndarray) -> np.ndarray:
        return np.interp(np.linspace(0, len(values) - 1, samples), np.arange(len(values)), np.nan_to_num(values))

    rng = np.random.default_rng(5)
    measured = stretched(one.measured) + rng.normal(0, one.noise, samples)
    measured[123_456], measured[50_000] = SPIKE, np.nan
    return replace(
        one, t=np.arange(samples) / 500.0, position=stretched(one.position), velocity=stretched(one.velocity),
        force=stretched(one.force) + rng.normal(0, 1, samples), measured=measured, simulated=stretched(one.simulated),
    )  # fmt: skip


IDLE = "Bokeh.documents.length > 0 && Bokeh.documents.every(d => d.is_idle)"
"""Everything in view is drawn."""
LARGER = Whiteness(False, 0.0, 1.3, 0.0)
"""Errors on held-out recordings that are larger than noise."""
ANSWERS = {
    "none": "Nothing is missing: on recording, which was not fitted, the model's errors are no larger than noise.",
    "named": "The model lacked one effect, hardening spring: the spring stiffens along the stroke",
    "class": "The model lacked one effect, hardening spring",
    "unlisted": "Something is missing, but only the held-out recordings show it.",
    "imposed": "The model lacked",
}
"""Answers of traces by name, and with what their pages begin."""


def answered(name: str) -> Trace:
    """A trace with that answer."""
    if name == "imposed":
        return traced_valves.traced_imposed("hardening_spring", k3=3e6)
    found = (
        traced_valves.traced(None) if name in ("none", "unlisted") else traced_valves.traced("hardening_spring", k3=3e5)
    )
    if name == "class":
        return replace(found, selection=replace(found.selection, same_class=("flow_force",)))
    if name == "unlisted":
        seen = replace(found.selection, verdict="unlisted", before=LARGER, after=LARGER)
        return replace(found, selection=seen, residual=describe_residual(seen))
    return found
