"""The JSON files that commands write: models, traces, comparisons, assessments, tests, evaluations, states, events."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import wraps
from pathlib import Path
from typing import Any

from bristle.cli.output.tables import in_lines, words_table
from recordings import BadInput

FileContent = Mapping[str, Any]


def facts(file: Path) -> FileContent:
    """What stands in the file. Raises BadInput when it is no JSON object."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(str(file), f"it cannot be read ({error})", "write it anew with the command it is from") from None
    if not isinstance(content, dict):
        raise BadInput(str(file), "it is no JSON object", "write it anew with the command it is from")
    return content


def _told(lines: Callable[[FileContent], Iterator[str]]) -> Callable[[Path], str]:
    """The words of a file of which `lines` tells. Raises BadInput where it has not what such a file has."""

    @wraps(lines)
    def words(file: Path) -> str:
        try:
            return "\n".join(lines(facts(file)))
        except (LookupError, TypeError, AttributeError, ValueError) as error:
            if isinstance(error, BadInput):
                raise
            found = f"something is missing in it ({error!r})"
            raise BadInput(str(file), found, "write it anew with the command it is from") from None

    return words


def model_words(file: Path) -> str:
    """A model."""
    from bristle.cli.console import model_words as words
    from simulator import ValveModel

    return words(ValveModel.read(file))


def trace_words(file: Path) -> str:
    """A trace."""
    from bristle.cli.tracing import trace_words as words

    return words(file)


@_told
def comparison_words(content: FileContent) -> Iterator[str]:
    """A comparison."""
    yield f"comparison of {content['before']} and {content['after']} ({content['kind']})"
    yield f"changed: {', '.join(content['changed']) or 'nothing beyond noise and repeatability'}"
    rows = [
        (q["name"], q["unit"], _sized(q["before"]), _sized(q["after"]), "yes" if q["changed"] else "no")
        for q in content["quantities"]
    ]
    yield from in_lines(words_table(("quantity", "unit", "before", "after", "changed"), rows))
    yield from content["notes"]


@_told
def assessment_words(content: FileContent) -> Iterator[str]:
    """An assessment of a loop."""
    likely = content["probability"]
    sure = "" if likely is None else f", probability of stiction {likely:.2f}"
    yield f"control loop: {content['verdict']}{sure}"
    yield content["why"]
    about = content["data"]
    yield f"{about['samples']} samples every {about['dt_s']:.6g} s, {about['cycles']:.3g} cycles"
    yield from (f"oscillation: period {one['period_s']:.4g} s" for one in content["oscillation"])
    for name, one in (content["stiction"] or {}).items():
        yield f"{name}: {_interval(one)}"
    yield from about["problems"]
    rows = [(one["method"], one["says"], one["why"]) for one in content["methods"]]
    yield from in_lines(words_table(("method", "says", "why"), rows))


@_told
def test_words(content: FileContent) -> Iterator[str]:
    """A standard test."""
    yield f"valve test: {content['kind']}"
    for name, value in content["values"].items():
        if isinstance(value, Mapping) and "value" in value:
            yield f"  {name}: {_interval(value)}"
        elif name == "steps":
            yield f"  {len(value)} steps"
        elif isinstance(value, str | int | float):
            yield f"  {name}: {value}"
        elif name == "bench_set_kPa":
            yield f"  {name}: {' to '.join(_interval(one) for one in value)}"
    for one in content["changed"] or ():
        yield f"changed: {one['name']}"
    yield from content["problems"]


test_words.__test__ = False  # type: ignore[attr-defined]  # pytest must not take it for one of its tests


@_told
def evaluation_words(content: FileContent) -> Iterator[str]:
    """An evaluation of detectors."""
    yield "evaluation of detectors"
    for name, rows in content["tables"].items():
        if rows and name not in {"trials", "isolation"}:
            yield ""
            yield from in_lines(words_table(tuple(rows[0]), [tuple(row.values()) for row in rows], title=name))


@_told
def state_words(content: FileContent) -> Iterator[str]:
    """What a monitor has learned."""
    yield f"monitor state, version {content['version']}: {len(content['valves'])} valves"
    for name, one in content["valves"].items():
        alarm = one["state"].get("alarm")
        yield f"  {name}: learned{', ALARM' if alarm else ''}"
    effects = json.loads(content["model"])["effects"]
    yield f"learned with a model of {', '.join(effects)}"


def events_words(file: Path) -> str:
    """Events, one a line."""
    events = events_facts(file)["events"]
    counted = ", ".join(f"{n} {kind}" for kind, n in Counter(one["kind"] for one in events).items())
    lines = [f"{one['time']}  {one['valve']}  {one['kind']}  {one['text']}" for one in events[-SHOWN:]]
    left = [f"the last {SHOWN}:"] if len(events) > SHOWN else []
    return "\n".join([f"{file}: {len(events)} events{f': {counted}' if counted else ''}", *left, *lines])


SHOWN = 20
"""Events that are shown."""
LARGEST_EVENTS = 32_000_000


def events_facts(file: Path) -> FileContent:
    """The events of a file. Raises BadInput naming the line that is none."""
    events: list[dict[str, Any]] = []
    number = 0
    try:
        if file.stat().st_size > LARGEST_EVENTS:
            found = f"it is larger than {LARGEST_EVENTS // 1_000_000} MB"
            raise BadInput(str(file), found, f"show its end: tail -n 10000 {file.name} > last.jsonl")
        with file.open(encoding="utf-8") as lines:
            for line in lines:
                number += 1
                event = json.loads(line)
                if not {"time", "valve", "kind", "text"} <= set(event):
                    raise ValueError("it has no time, valve, kind and text")
                events.append(event)
    except OSError as error:
        raise BadInput(str(file), f"it cannot be read ({error.strerror})", "check the path") from None
    except BadInput:
        raise
    except (ValueError, TypeError, RecursionError) as error:
        found = f"it is no event ({error})"
        raise BadInput(f"{file}: line {number}", found, "give a file of bristle monitor --events") from None
    return {"format": "monitor-events", "version": 1, "events": events}


def _sized(one: FileContent) -> str:
    return f"{one['value']:.5g} ± {one['std']:.2g}"


def _interval(one: FileContent) -> str:
    return f"{one['value']:.4g} ({one['lower']:.4g} to {one['upper']:.4g})"
