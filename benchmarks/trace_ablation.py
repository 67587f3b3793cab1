"""What each number of tracing is good for: traces with one of them doubled, halved, or its rule switched off.

`python -m benchmarks.trace --ablation --valves 7001,7002 --minutes 60` goes on where it stopped. A case is a short
recording of a valve of the catalogue's own physics, so that many can be traced. A number that a trace never read cannot
have changed its answer, so only those that were read are varied, and the others count as trials without a change.
"""

from __future__ import annotations

import itertools
import json
import math
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks.machine import commit
from identification import trace_settings as settings
from recordings import Recording, Signal
from simulator import BASE, CATALOGUE, Excitation, Sensors, random_valve, simulate

RESULTS = Path("build/trace-ablation.jsonl")
COURSES = ("staircase:10", "sine:10", "multisine:8")
"""The recordings of a case; the last one is held out."""
EFFECTS = (None, *(e for e in CATALOGUE.ids if e not in BASE))
OFF: dict[str, Any] = {
    "REPEATS": 1, "STIFFNESS_GROWTH": math.inf, "AT_LEAST": 1, "GAIN_SHARE": 0.0, "FAR_SHARE": 0.0, "CHANCE_GAIN": 0.0,
    "LEFT_OUT_BLOCKS": 10**9, "MIN_GAIN": 0.0, "SMALL_SHARE": 0.0,
    "EXPLAINED": 0.0, "EXPLAINED_FITTED": 0.0, "MAX_LOSS_ONE": math.inf,
    "MAX_LOSS_SEVERAL": math.inf, "CLEAR_GAIN": 0.0, "CLEAR_GAIN_UNRESOLVED": 0.0,
}  # fmt: skip
"""Values at which the rule of a number is off: it gives nothing up, allows everything, or is never met."""
CHANGES = ("x 2", "/ 2", "off")
Row = dict[str, Any]
Tracer = Callable[..., Any]


@dataclass(frozen=True)
class Short:
    """A case: the seed of a valve, an effect at its typical strength or None, and whether a rig imposes the motion."""

    valve: int
    effect: str | None
    rig: bool

    @property
    def name(self) -> str:
        """A short unique name."""
        return f"{self.effect or 'none'}-v{self.valve}{'-rig' * self.rig}"

    def recordings(self, rate: float = 250.0) -> list[Recording]:
        """The recordings: position noise 1e-4 of the stroke, force noise 0.03 % of the span, `rate` in Hz."""
        valve, stroke = random_valve(self.valve)
        for p in CATALOGUE[self.effect].parameters if self.effect else ():
            valve[CATALOGUE[self.effect].parameter_name(p.symbol)] = stroke if p.known else p.scale
        sensors = Sensors(rate, position_noise=1e-4 * stroke, force_noise=3e-4 * valve["spring.K"] * stroke)
        effects = tuple(e for e in CATALOGUE.ids if e in (*BASE, self.effect))
        made = [
            simulate(valve, Excitation.parse(course), sensors, stroke=stroke, effects=effects, seed=i)[0]
            for i, course in enumerate(COURSES)
        ]
        return [_of_a_rig(r) for r in made] if self.rig else made


def cases(valves: Sequence[int], effects: Sequence[str] = (), *, rig: bool = False) -> Iterator[Short]:
    """The cases of some valves: every effect and none, as they drive the force and as a rig imposes the motion, or as
    a rig alone, which takes seconds.
    """
    for effect, valve, imposed in itertools.product(effects or EFFECTS, valves, (True,) if rig else (False, True)):
        yield Short(valve, effect, imposed)


def variations(name: str) -> Iterator[tuple[str, Any]]:
    """What a number is set to: doubled, halved, and off where that means something (`CHANGES`)."""
    value = getattr(settings, name)
    yield from (("x 2", _scaled(value, 2.0)), ("/ 2", _scaled(value, 0.5)))
    if name in OFF:
        yield "off", OFF[name]


def ablation(
    work: Sequence[Short], minutes: float, path: Path = RESULTS, tracer: Tracer | None = None,
    head: str | None = None, changes: Sequence[str] = CHANGES,
) -> list[Row]:  # fmt: skip
    """The rows of all cases and variations of one commit; those that are missing are run while there is time.

    minutes : of processor time after which none is begun; changes : that are made.
    """
    head, began = head or commit(), time.process_time()
    path.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    rows = {(r["case"], r["number"], r["change"]): r for r in known if r["commit"] == head}
    with path.open("a") as file:

        def run(case: Short, number: str, change: str, value: Any) -> Row | None:
            key = case.name, number, change
            if key not in rows and time.process_time() - began < 60 * minutes:
                rows[key] = _row(case, number, change, value, tracer) | {"commit": head}
                file.write(json.dumps(rows[key]) + "\n")
                file.flush()
            return rows.get(key)

        for case in work:
            plain = run(case, "", "", None)
            for number in plain["read"] if plain else ():
                for change, value in variations(number):
                    if change in changes:
                        run(case, number, change, value)
    return list(rows.values())


def table(rows: Sequence[Row]) -> list[str]:
    """A line for each number: trials of each change, and in how many of them the answer was another, or a wrong one."""
    plain = {row["case"]: row for row in rows if not row["number"]}
    made, varied = {row["change"] for row in rows}, defaultdict[tuple[str, str], list[Row]](list)
    for row in rows:
        if row["number"]:
            varied[row["number"], row["change"]].append(row)
    lines = [
        f"{len(plain)} cases, {sum(row['right'] for row in plain.values())} right with all numbers as they are.", "",
        "| number | value | change | read in | run | other answers | right before | right then |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    for name in numbers():
        read = sum(name in row["read"] for row in plain.values())
        for change, _ in variations(name):
            if change not in made:
                continue
            some = varied[name, change]
            pairs = [(plain[row["case"]], row) for row in some]
            other = sum(before["answer"] != row["answer"] for before, row in pairs)
            right = sum(before["right"] for before, _ in pairs), sum(row["right"] for _, row in pairs)
            figures = name, _said(getattr(settings, name)), change, read, len(some), other, *right
            lines.append("| " + " | ".join(map(str, figures)) + " |")
    return lines


def numbers() -> list[str]:
    """The names of all numbers of the settings file, in its order."""
    return [name for name in vars(settings) if name.isupper()]


def _row(case: Short, number: str, change: str, value: Any, tracer: Tracer | None) -> Row:
    if tracer is None:
        from identification import trace as tracer
    *fitted, held_out = case.recordings()
    with _reading() as read, _set(number, value):
        clock = time.process_time()
        try:
            found = tracer(fitted, holdout=[held_out])
            verdict, alike = str(found.verdict), {found.verdict, *found.same_class}
            answer = [verdict, *sorted(found.effects_added)]
        except Exception as error:
            verdict, alike, answer = "failed", set[str](), ["failed", f"{type(error).__name__}: {error}"[:200]]
        seconds = time.process_time() - clock
    right = case.effect in alike if case.effect else verdict == "none"
    return {"case": case.name, "number": number, "change": change, "answer": answer, "right": bool(right),
            "read": sorted(read & {*numbers()}), "processor": seconds}  # fmt: skip


@contextmanager
def _reading() -> Iterator[set[str]]:
    """The names that are read of the settings meanwhile."""
    read, plain = set[str](), type(settings)

    class Watched(ModuleType):
        def __getattribute__(self, name: str) -> Any:
            read.add(name)
            return super().__getattribute__(name)

    settings.__class__ = Watched
    try:
        yield read
    finally:
        settings.__class__ = plain


@contextmanager
def _set(number: str, value: Any) -> Iterator[None]:
    """One number of the settings changed meanwhile; none where `number` is empty."""
    if not number:
        yield
        return
    before = getattr(settings, number)
    setattr(settings, number, value)
    try:
        yield
    finally:
        setattr(settings, number, before)


def _scaled(value: Any, factor: float) -> Any:
    """A number times a factor."""
    if hasattr(value, "h_max"):
        return replace(value, h_max=factor * value.h_max)
    return max(1, round(factor * value)) if isinstance(value, int) else factor * value


def _said(value: Any) -> str:
    return f"h_max {value.h_max:g} s" if hasattr(value, "h_max") else str(value)


def _of_a_rig(recording: Recording) -> Recording:
    roles = {"time": "time", "position": "input", "force": "output"}
    signals = [Signal(name, recording[name].values, recording[name].unit, role) for name, role in roles.items()]
    return Recording.of(signals, plant=recording.plant, source="simulated", title="rig")
