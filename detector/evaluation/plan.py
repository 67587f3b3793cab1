"""What an evaluation does: detectors, scenarios, variants of the plant, numbers of trials and hours, in one value."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from typing import Any

from detector.evaluation.benchmark.runs import RATES
from detector.evaluation.detectors import DETECTORS
from recordings import BadParameter
from simulator.damadics import FORMS, SCENARIOS, Form, Scenario

BENCHMARK = tuple(name for name, one in SCENARIOS.items() if one.benchmark)
"""The 44 scenarios of Step I."""

MAIN = "play-1"
"""The benchmark as published: its play, a sample a second."""

VARIANTS = (MAIN, *(f"lugre-{rate}" for rate in RATES))
"""Friction and sampling rate [Hz]."""

SMOKE = ("f1-abrupt-big", "f14-abrupt-big", "f18-abrupt-big")
"""Scenarios enough to try whether everything works: two that are easily seen, one that nobody can see."""

_LONG_S = 6000.0
_LISTED = 20
"""More names than that are not all listed."""


@dataclass(frozen=True)
class Plan:
    """detectors, scenarios, variants : by name; seeds, long_seeds : trials of each scenario of the main variant, and of
    its day-long ones; other_seeds : the same of the other variants; rate_per_h : stated rate of false alarms;
    healthy_h, other_healthy_h : fault-free hours to learn from, to calibrate on, and to judge; starts : short
    fault-free runs to calibrate on and to judge, every second of which starts elsewhere than the benchmark; examples :
    runs per fault and mode for the signatures; long_h, other_long_h : for how long day-long faults are followed in the
    main and in other variants [h]; seeds_from : added to the seed of every run, so that others judge than those that
    were developed on.

    Raises BadParameter for an unknown scenario or variant, or numbers that cannot be. Detectors may be somebody's own:
    `evaluate` knows them.
    """

    detectors: tuple[str, ...] = tuple(DETECTORS)
    scenarios: tuple[str, ...] = BENCHMARK
    variants: tuple[str, ...] = VARIANTS
    seeds: int = 5
    long_seeds: int = 3
    other_seeds: tuple[int, int] = (1, 2)
    rate_per_h: float = 0.01
    healthy_h: tuple[float, float, float] = (24.0, 96.0, 96.0)
    other_healthy_h: tuple[float, float, float] = (8.0, 48.0, 48.0)
    starts: tuple[int, int] = (48, 16)
    examples: int = 4
    long_h: float = 24.0
    other_long_h: float = 2.0
    seeds_from: int = 0

    def __post_init__(self) -> None:
        check_names("scenarios", self.scenarios, BENCHMARK)
        check_names("variants", self.variants, VARIANTS)
        if not (self.seeds >= 1 and self.long_seeds >= 1 and self.examples >= 0):
            raise BadParameter("seeds", self.seeds, "there are no trials", "give 1 at least")
        if not (0 < self.rate_per_h < 10):
            found = f"{self.rate_per_h:g} an hour cannot be calibrated for"
            raise BadParameter("false_alarms", f"{self.rate_per_h:g}", found, "give a rate above 0 and below 10")

    @property
    def forms(self) -> dict[Form, tuple[int, ...]]:
        """Sampling rates by form of the friction."""
        split = [variant.rsplit("-", 1) for variant in self.variants]
        return {f: tuple(int(r) for g, r in split if g == f) for f in FORMS if any(g == f for g, _ in split)}

    def duration(self, form: Form, what: Scenario) -> float:
        """How long a scenario is run [s]."""
        followed_h = self.long_h if form == "play" else self.other_long_h
        return min(what.thor, 900.0 + max(followed_h * 3600, 4200.0))

    def trials(self, form: Form, what: Scenario) -> int:
        """How often a scenario is run."""
        usual, long = (self.seeds, self.long_seeds) if form == "play" else self.other_seeds
        return long if what.thor > _LONG_S else usual

    def hours(self, form: Form) -> tuple[float, float, float]:
        """Fault-free hours to learn from, to calibrate on and to judge."""
        return self.healthy_h if form == "play" else self.other_healthy_h

    @property
    def key(self) -> str:
        """Names what everything learned depends on: results of an equal key are resumed."""
        parts: dict[str, Any] = asdict(self)
        for free in ("scenarios", "seeds", "long_seeds", "other_seeds", "variants"):
            parts.pop(free)
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:12]


def smoke(detectors: Sequence[str] = ("bank", "limits"), scenarios: Sequence[str] = SMOKE) -> Plan:
    """The smallest evaluation that goes through everything, about half a minute."""
    return Plan(
        tuple(detectors), tuple(scenarios), (MAIN,), seeds=1, long_seeds=1, other_seeds=(1, 1), rate_per_h=0.5,
        healthy_h=(1.2, 3.0, 1.0), other_healthy_h=(1.2, 3.0, 1.0), starts=(6, 2), examples=0,
    )  # fmt: skip


def check_names(parameter: str, names: Sequence[str], allowed: Sequence[str]) -> None:
    """Refuse names that are not allowed. Raises BadParameter."""
    for name in names:
        if name not in allowed:
            near = get_close_matches(name, allowed, 5, 0.4) if len(allowed) > _LISTED else []
            some = f"near to it are {', '.join(near)}" if near else f"there are {', '.join(allowed)}"
            raise BadParameter(parameter, name, "there is none of that name", some)
    if not names:
        raise BadParameter(parameter, "", "nothing is named", f"there are {', '.join(allowed)}")
