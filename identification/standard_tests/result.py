"""What a standard test found: the content of `test.json`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identification.shown_findings import ShownFindings
from identification.standard_tests.interval import Interval
from recordings import BadInput, ReportOpening, read_small_json, save_json

if TYPE_CHECKING:
    from identification.report.findings_page import Findings

FORMAT, VERSION = "valve-test", 1


@dataclass(frozen=True, repr=False)
class ValveTest(ShownFindings):
    """A standard test of a valve. kind : which; values : by name, the unit is its end; changed : against a reference,
    None without one; problems : what limits it, in sentences; curves : pairs of arrays for pictures, by name; tag :
    of the valve; files : the recordings.
    """

    kind: str
    values: Mapping[str, Any]
    changed: tuple[Mapping[str, Any], ...] | None
    problems: tuple[str, ...]
    curves: Mapping[str, Any]
    tag: str | None = None
    files: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return "\n".join([f"{self.kind} test", *self.lines()])

    @property
    def aborted(self) -> tuple[str, ...]:
        """Why a partial stroke failed; empty where it did not."""
        return tuple(self.values.get("abort_reasons", ()))

    def as_json(self) -> dict[str, Any]:
        """The content of `test.json`."""
        changed = None if self.changed is None else [dict(one) for one in self.changed]
        head = {"format": FORMAT, "version": VERSION, "kind": self.kind}
        return {**head, "values": plain(self.values), "changed": changed, "problems": list(self.problems)}

    def lines(self) -> list[str]:
        """The result in lines for a terminal."""
        found = [f"{name}: {_words(value)}" for name, value in self.values.items() if isinstance(value, Interval)]
        if "bench_set_kPa" in self.values:
            found.append("bench_set_kPa: " + " to ".join(_words(one) for one in self.values["bench_set_kPa"]))
        if "steps" in self.values:
            found.append(f"medians of {len(self.values['steps'])} steps")
        if self.changed is not None:
            found += [changed_words(one) for one in self.changed] or ["nothing changed beyond the noise of both tests"]
        return [*found, *(f"failed: {reason}" for reason in self.aborted), *self.problems]

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `test.json`, all or nothing. Raises BadInput when it cannot be written."""
        save_json(Path(path), self.as_json())

    def findings(self) -> Findings:
        """What its page shows."""
        from identification.report.findings_page import Findings

        rows = [(name, *_ends(value)) for name, value in self.values.items() if isinstance(value, Interval)]
        words = [line for line in self.lines() if not line.startswith(tuple(self.values))]
        table = (("quantity", "value", "lower", "upper"), rows)
        heading = f"Valve {self.tag}: {self.kind} test" if self.tag else f"Valve test: {self.kind}"
        lines = (", ".join(self.files),) if self.files else ()
        return Findings(heading, "Valve test", tuple(words), (table,), self.curves, self._opening(), lines)

    def _opening(self) -> ReportOpening:
        """What the page opens with."""
        limits = f"; {self.problems[0]}" if self.problems else ""
        sure = f"intervals of 95 % stand beside every value{limits}"
        if self.aborted:
            why = f"the partial stroke failed: {'; '.join(self.aborted)}"
            return ReportOpening(
                "repair", why, sure, "look at supply, positioner and packing before the valve is relied on"
            )
        if self.changed:
            why = "; ".join(changed_words(one) for one in self.changed)
            return ReportOpening(
                "watch", why, sure, "test again in the same way; if it goes on, plan work on the valve"
            )
        if self.changed is None:
            why = (
                "the test was carried out; with nothing to compare, it says how the valve is and not whether it changed"
            )
            action = "keep test.json, and give it to the next test as its reference"
            return ReportOpening("watch" if self.problems else "good", why, sure, action)
        return ReportOpening(
            "good", "nothing changed beyond the noise of both tests", sure, "test again at the next inspection"
        )


def plain(value: Any) -> Any:
    """Values with their intervals as JSON has them."""
    if isinstance(value, Interval):
        return value.as_json()
    if isinstance(value, Mapping):
        return {name: plain(one) for name, one in value.items()}
    return [plain(one) for one in value] if isinstance(value, list | tuple) else value


def changed_words(one: Mapping[str, Any]) -> str:
    """A change in a sentence."""
    before, after = one["before"]["value"], one["after"]["value"]
    return f"{one['name']} changed from {before:.4g} to {after:.4g}"


def reference_values(path: str | os.PathLike[str], kind: str) -> Mapping[str, Any]:
    """The values of a reference test. Raises BadInput when it is no test of this kind."""
    remedy = f"give a test.json of a test of the kind {kind}"
    content = read_small_json(Path(path), remedy)
    if not isinstance(content, dict) or content.get("format") != FORMAT or not isinstance(content.get("values"), dict):
        raise BadInput(str(path), "it is no valve test", remedy)
    if content.get("kind") != kind:
        raise BadInput(f"{path}: kind", f"it is a test of the kind {content.get('kind')!r}", remedy)
    return dict(content["values"])


def _words(value: Interval) -> str:
    return f"{value.value:.4g} ({value.lower:.4g} to {value.upper:.4g})"


def _ends(value: Interval) -> tuple[str, str, str]:
    return f"{value.value:.4g}", f"{value.lower:.4g}", f"{value.upper:.4g}"
