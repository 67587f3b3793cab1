"""The next test: its sequence, and what it is expected to achieve."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.next_test.bounds import DesignBounds
from identification.next_test.expectation import TOLD, Expectation
from identification.next_test.knowledge import KnownValve
from identification.shown_findings import ShownFindings
from recordings import Array, ReportOpening, save_text

if TYPE_CHECKING:
    from identification.report.findings_page import Findings

INTERVAL = 1.96
"""Half width of a 95 % interval, in standard deviations."""


@dataclass(frozen=True, repr=False)
class NextTest(ShownFindings):
    """The test that tells most.

    family : which kind of sequence; t (n_samples,) [s]; column, sequence : name with unit, and values of what is to be
    asked; valves : the models, the first of which is driven; weak : the parameters it is for, where there is one model;
    expected : what it achieves; references : the same of other tests of the same length and limits, by name;
    reference_sequences : what those ask, as `sequence`.
    """

    family: str
    bounds: DesignBounds
    t: Array
    column: str
    sequence: Array
    valves: tuple[KnownValve, ...]
    weak: tuple[str, ...]
    expected: Expectation
    references: Mapping[str, Expectation]
    reference_sequences: Mapping[str, Array]

    @property
    def settles(self) -> bool:
        """Whether the test is expected to tell what it is for."""
        if len(self.valves) > 1:
            return self.expected.distance >= TOLD
        return not self.expected.still_weak(self.valves[0], self.weak)

    def as_json(self) -> dict[str, Any]:
        """The proposal as a JSON object, without the sequence."""
        return {
            "format": "next-test", "version": 1, "family": self.family, "duration_s": float(self.t[-1]),
            "drive": self.column, "range": [float(self.sequence.min()), float(self.sequence.max())],
            "travel_percent": list(self._travel()), "settles": self.settles, "for": list(self._aims()),
            "expected": self._expected(self.expected),
            "references": {name: self._expected(one) for name, one in self.references.items()},
        }  # fmt: skip

    def lines(self) -> list[str]:
        """The proposal in lines for a terminal."""
        name, _, unit = self.column.rpartition("_")
        unit, (low, high) = unit.replace("percent", "%"), (float(self.sequence.min()), float(self.sequence.max()))
        found = [
            f"{self.family}, {self.t[-1]:.4g} s, {name} from {low:.4g} to {high:.4g} {unit}; expected travel "
            f"{self._travel()[0]:.1f} to {self._travel()[1]:.1f} % of the stroke"
        ]
        return [*found, *(self._rival_lines() if len(self.valves) > 1 else self._parameter_lines())]

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the sequence as CSV: time, what is asked, and where every model expects the stem. All or nothing."""
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        stroke = self.valves[0].stroke
        names = [v.name for v in self.valves] if len(self.valves) > 1 else [""]
        heads = [f"expected_position_percent{' of ' if name else ''}{name}" for name in names]
        table.writerow(["time_s", self.column, *heads])
        paths = [100 * self.expected.paths[valve.name] / stroke for valve in self.valves]
        for row in zip(self.t, self.sequence, *paths, strict=True):
            table.writerow([f"{value:.6g}" for value in row])
        save_text(Path(path), text.getvalue())

    def findings(self) -> Findings:
        """What its page shows."""
        from identification.report.findings_page import Findings

        stroke = self.valves[0].stroke
        paths = [(name, self.t, 100 * y / stroke) for name, y in self.expected.paths.items()]
        curves = {
            "Sequence": ("time [s]", self.column, [("asked", self.t, self.sequence)]),
            "Expected position": ("time [s]", "% of the stroke", paths),
        }
        heading, lines = f"Next test: {self.family}", tuple(self.lines())
        return Findings(heading, "Next test", lines, (self._table(),), curves, self._opening())

    def _opening(self) -> ReportOpening:
        """Whether the test is worth running."""

        sure = "expected by simulation of the models, on the noise of their recordings"
        if self.settles:
            return ReportOpening(
                "good", "the test is expected to tell", sure, "run the sequence, and fit or trace again"
            )
        return ReportOpening("watch", "the test is not expected to tell", sure, "allow more travel, rate or time")

    def _travel(self) -> tuple[float, float]:
        """Lowest and highest expected position of any model, % of the stroke."""
        every = np.concatenate(list(self.expected.paths.values())) * 100 / self.valves[0].stroke
        return float(every.min()), float(every.max())

    def _aims(self) -> tuple[str, ...]:
        return tuple(v.name for v in self.valves) if len(self.valves) > 1 else self.weak

    def _expected(self, one: Expectation) -> dict[str, Any]:
        if len(self.valves) > 1:
            return {"distances": [{"rivals": list(pair), "sigmas": d} for pair, d in one.distances.items()]}
        return {"half_95": {name: INTERVAL * std for name, std in one.std.items()}}

    def _rival_lines(self) -> list[str]:
        found = []
        for pair, distance in self.expected.distances.items():
            others = ", ".join(f"{name} {one.distances[pair]:.3g}" for name, one in self.references.items())
            found.append(f"{pair[0]} and {pair[1]}: {distance:.3g} noise sigmas apart ({others})")
        if not self.settles:
            found.append(f"below {TOLD:g} sigmas a test does not tell: allow more travel, rate or time")
        return found

    def _parameter_lines(self) -> list[str]:
        valve, found = self.valves[0], []
        for name in self.weak:
            value, unit = valve.values[name], _unit(valve, name)
            others = ", ".join(f"{other} ± {INTERVAL * one.std[name]:.2g}" for other, one in self.references.items())
            now = f"± {INTERVAL * _now(valve, name):.2g} now"
            then = f"± {INTERVAL * self.expected.std[name]:.2g} expected"
            found.append(f"{name} {value:.4g} {unit}: {now}, {then} ({others})")
        weak = self.expected.still_weak(valve, self.weak)
        if weak:
            found.append(f"{', '.join(weak)}: weak after the test as well: allow more, or sample faster")
        return found

    def _table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        heads = ("", self.family, *self.references)
        every = (self.expected, *self.references.values())
        if len(self.valves) > 1:
            pairs = self.expected.distances
            rows = [(f"{a}, {b} [noise sigmas]", *(f"{one.distances[a, b]:.3g}" for one in every)) for a, b in pairs]
            return heads, rows
        valve = self.valves[0]
        half = [(f"{n} ± [{_unit(valve, n)}]", *(f"{INTERVAL * one.std[n]:.3g}" for one in every)) for n in valve.names]
        return heads, half


def _now(valve: KnownValve, name: str) -> float:
    """The standard deviation of a parameter before the test, SI units."""
    i = valve.names.index(name)
    return float(valve.std[i] * abs(valve.coordinates.slope(valve.p)[i]))


def _unit(valve: KnownValve, name: str) -> str:
    return valve.kernel.catalogue.parameters(valve.kernel.effects)[name].unit
