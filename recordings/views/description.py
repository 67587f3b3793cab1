"""A recording in words: what is in it, how it is sampled, and what it is good for. Reads one signal at a time."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from recordings.arrays import Array, IndexArray
from recordings.hdf5.reader import RecordingFile, open_recording
from recordings.sample_checks import NOT_KNOWN, QUALITIES, holds_number
from recordings.signal import SignalSpec
from recordings.views.pictures import GAP_STEPS

WIDTH = 80
"""Characters that every terminal has."""
ABOUT = 6 * " "
"""Before what is said about a signal, where it does not fit behind its numbers."""


def describe(path: str | Path) -> str:
    """What a recording holds, in lines of text; `BadInput` when it is not a valid recording."""
    with open_recording(path) as file, np.errstate(all="ignore"):  # a file may say any number
        time = file.signal("time").values
        parts = [_head(file, time), _sampling(time), _table(file), _quality(file)]
        parts += [_plant(file), _events(file), _attributes(file), _use(file)]
    return "\n\n".join(part for part in parts if part)


def _head(file: RecordingFile, time: Array) -> str:
    about = [file.header.title, file.header.source]
    about += [file.header.created.isoformat(sep=" ", timespec="seconds") if file.header.created else None]
    words = ", ".join(part for part in about if part)
    return f"{file.path}: recording of {len(time)} samples over {time[-1] - time[0]:.6g} s" + (
        f"\n{words}" if words else ""
    )


def _sampling(time: Array) -> str:
    steps = np.diff(time)
    median = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP_STEPS * median)
    even = steps.max() - steps.min() < 0.01 * median
    step = float(steps.mean()) if even else median
    spread = "" if even else f", in fact {steps.min():.4g} to {steps.max():.4g} s"
    lines = [f"time from {time[0]:.6g} s, every {step:.6g} s ({1 / step:.6g} Hz){spread}"]
    if len(gaps):
        longest = int(gaps[np.argmax(steps[gaps])])
        words = f"the longest {steps[longest]:.4g} s, after {time[longest]:.6g} s"
        lines.append(f"{len(gaps)} gaps of more than {GAP_STEPS} steps, {words}")
    return "\n".join(lines)


def _table(file: RecordingFile) -> str:
    rows: list[tuple[str, ...]] = [("signal", "role", "unit", "from", "to", "missing", "")]
    specs = [spec for spec in file.header.signals if spec.role != "time"]
    rows += [_row(spec, file.signal(spec.name, may_be_missing=True).values) for spec in specs]
    widths = [max(len(row[k]) for row in rows) for k in range(6)]
    return "\n".join(_line(row, widths) for row in rows)


def _row(spec: SignalSpec, values: Array) -> tuple[str, ...]:
    missing = int(np.isnan(values).sum())
    low, high = (np.nan, np.nan) if missing == len(values) else (np.nanmin(values), np.nanmax(values))
    extra = [spec.description or ""]
    extra += [f"resolution {spec.resolution:.3g}"] if spec.resolution is not None else []
    extra += [f"noise {spec.noise_std:.3g}"] if spec.noise_std is not None else []
    share = f"{100 * missing / len(values):.3g} %" if missing else "-"
    return (
        spec.name,
        spec.role,
        spec.unit,
        f"{low:.5g}",
        f"{high:.5g}",
        share,
        "; ".join(part for part in extra if part),
    )


def _line(row: Sequence[str], widths: Sequence[int]) -> str:
    left = [cell.ljust(width) for cell, width in zip(row[:3], widths[:3], strict=True)]
    right = [cell.rjust(width) for cell, width in zip(row[3:6], widths[3:6], strict=True)]
    numbers, words = "  " + "  ".join([*left, *right]), row[6]
    whole = f"{numbers}  {words}".rstrip()
    if len(whole) <= WIDTH:
        return whole
    return "\n".join([numbers, *textwrap.wrap(words, WIDTH, initial_indent=ABOUT, subsequent_indent=ABOUT)])


def _quality(file: RecordingFile) -> str:
    """How many values were not good, and why, where the file keeps that."""
    if not file.header.per_value:
        return ""
    names = [spec.name for spec in file.header.signals if spec.role != "time"]
    counts = {name: np.bincount(file.quality(name), minlength=len(QUALITIES)) for name in names}
    found = {name: _counted(n) for name, n in counts.items() if n[1:].any()}
    if not found:
        return "every value is good, with the time of its reply"
    return "\n".join(["values that are not good:", *(f"  {name}: {words}" for name, words in found.items())])


def _counted(counts: IndexArray) -> str:
    """Counts of values by the code of their quality in words."""
    words = [f"{n} {word}" for n, word in zip(counts[1:], QUALITIES[1:], strict=False) if n]
    words += [f"{counts[NOT_KNOWN]} not known"] if len(counts) > NOT_KNOWN else []
    return ", ".join(words)


def _plant(file: RecordingFile) -> str:
    return _pairs("plant", file.header.plant.known())


def _attributes(file: RecordingFile) -> str:
    return _pairs("further attributes", file.header.attributes)


def _pairs(title: str, pairs: Mapping[str, str | float]) -> str:
    lines = [f"  {name} = {value if isinstance(value, str) else format(value, '.9g')}" for name, value in pairs.items()]
    return "\n".join([f"{title}:", *lines]) if lines else ""


def _events(file: RecordingFile) -> str:
    if not file.events:
        return ""
    kinds = ", ".join(f"{count} {kind}" for kind, count in Counter(event.kind for event in file.events).items())
    lines = [f"  {event.time:.6g} s  {event.kind}  {event.text}" for event in file.events[:10]]
    return "\n".join([f"events: {kinds}", *lines, *(["  ..."] if len(file.events) > 10 else [])])


def _use(file: RecordingFile) -> str:
    """What a fit could do with it, by the rule of the format."""
    specs, area = file.specs, file.header.plant.diaphragm_area_m2
    empty = [name for name, spec in specs.items() if spec.role in ("input", "output") and not _has_numbers(file, name)]
    if empty:
        return f"nothing can be computed with it: every sample of {', '.join(empty)} is missing"
    if "position" not in specs:
        return "a fit needs a position, which is not here"
    if specs["position"].role == "input" and "force" in specs:
        return "a fit can predict the force from the position (the motion drives)"
    if "force" in specs:
        return "a fit can predict the position from the force"
    if "pressure" in specs and area is not None:
        return "a fit can predict the position from the pressure and the diaphragm area"
    missing = "the plant's diaphragm_area_m2" if "pressure" in specs else "a force or a pressure"
    return f"a fit needs {missing} besides the position, which is not here"


def _has_numbers(file: RecordingFile, name: str) -> bool:
    return holds_number(file.signal(name, may_be_missing=True).values)
