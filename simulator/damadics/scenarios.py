"""The benchmark's scenarios by name: 44 faults of Step I, the runs of Chapter 5, Example I, and a healthy valve.

Names: ``f1-abrupt-small``, ``f4-incipient``, ``f11-abrupt-big``, ...; ``healthy``; ``chapter5-healthy``,
``chapter5-f4``, ``chapter5-f11``; ``example1``. Source: Syfert et al., *Benchmark Definition*, v1.0, 2002.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from recordings import BadInput
from simulator.damadics import stimuli
from simulator.damadics.faults import FAULTS, Fault, FaultKind
from simulator.damadics.nearest_names import nearest
from simulator.damadics.stimuli import Stimulus

SWITCH_ON, ONSET, HORIZON = 300.0, 900.0, 600.0
"""ton, tfrom and tov of Step I [s]."""

_SLOW_HORIZON = 85500.0
"""thor of slow faults [s]: the benchmark's text counts them as 84 000 s long, its generator takes a day."""


@dataclass(frozen=True)
class Scenario:
    """One run: what the process does, and which faults occur.

    text : one line; thor : end of the judged run and its default length [s]; sample : default sampling interval [s];
    ton : the detector is judged from here on [s]; benchmark : whether it is one of the 44 of Step I.
    """

    name: str
    text: str
    stimulus: Stimulus
    thor: float
    faults: tuple[Fault, ...] = ()
    sample: float = 1.0
    ton: float = 0.0
    benchmark: bool = False

    @property
    def tfrom(self) -> float | None:
        """Onset of the first fault [s]; None for a healthy run."""
        return min((fault.start_s for fault in self.faults), default=None)

    @property
    def tfd(self) -> float | None:
        """Development time of the first fault [s]; None for a healthy run."""
        return min(self.faults, key=lambda fault: fault.start_s).development_s if self.faults else None


def scenario(name: str) -> Scenario:
    """The scenario of a name. Raises `BadInput` listing the nearest names when there is none.

    >>> scenario("f13-incipient").thor
    2400.0
    """
    if name not in SCENARIOS:
        raise BadInput("scenario", f"there is none named '{name}'", nearest(name, SCENARIOS))
    return SCENARIOS[name]


def _step_one(kind: FaultKind, mode: str) -> Scenario:
    fault = Fault.of_level(kind.number, mode, start_s=ONSET)
    manner = "incipient" if mode == "incipient" else f"abrupt-{mode}"
    thor = min(ONSET + fault.development_s + HORIZON, _SLOW_HORIZON)
    text = f"f{kind.number} {kind.name}, {manner.replace('-', ', ')}"
    return Scenario(f"f{kind.number}-{manner}", text, stimuli.step_one, thor, (fault,), ton=SWITCH_ON, benchmark=True)


def _chapter5(name: str, text: str, *faults: Fault) -> Scenario:
    return Scenario(f"chapter5-{name}", text, stimuli.chapter5, 120.0, faults, sample=0.0025)


def _all() -> list[Scenario]:
    stepping = "opening and closing of Chapter 5"
    return [
        Scenario("healthy", "Step I without a fault", stimuli.step_one, ONSET + HORIZON, ton=SWITCH_ON),
        *(_step_one(kind, mode) for kind in FAULTS.values() for mode in kind.modes),
        _chapter5("healthy", f"{stepping} without a fault"),
        _chapter5("f4", f"{stepping}, friction growing from 70 to 90 s", Fault(4, start_s=70.0, development_s=20.0)),
        _chapter5("f11", f"{stepping}, spring broken at 70 s", Fault(11, start_s=70.0)),
        Scenario("example1", "Example I of DABLib: sedimentation at 15 s, closing at 25 s", stimuli.example_one, 51.0,
                 (Fault(2, start_s=15.0),)),
    ]  # fmt: skip


SCENARIOS: Mapping[str, Scenario] = MappingProxyType({one.name: one for one in _all()})
"""All scenarios by name; those with `benchmark` set are the 44 of Step I."""
