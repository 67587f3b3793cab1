"""What an HDF5 file declares, taken out of it item by item against the format; no samples are read.

The file layout is the contract of recording format version 1 and its extension, version 2, which adds the quality and
the reply time of each value; `layout_writer` writes what this module reads.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Any, cast

import h5py

from recordings.errors import BadInput
from recordings.hdf5.header import ORIGINS, RESERVED, Header, attribute_problem, created_problem, signals_problem
from recordings.hdf5.items import (
    CLOCK_ROWS,
    NOT_PLAIN,
    check_column,
    clock_of,
    member,
    number_attribute,
    numbers_of,
    raw_attribute,
    text_attribute,
)
from recordings.hdf5.problems import Problems
from recordings.plant import PLANT_NAMES, Event, Plant, plant_problem
from recordings.sample_checks import codes_problem, value_problem
from recordings.signal import ROLES, Role, SignalSpec, unit_problem

FORMAT, VERSIONS = "valve-recording", (1, 2)


@dataclass(frozen=True)
class FileContents:
    """What a file declares: its header, its number of samples and its events."""

    header: Header
    n_samples: int
    events: tuple[Event, ...]


def layout_of(file: h5py.File, name: str, problems: Problems, *, values: bool = False) -> FileContents | None:
    """What an open file declares; None when problems were found and collected.

    name : the file, for messages; values : whether the samples are judged too, one signal after the other. Every
    violation of the format is noted in `problems`.
    """
    with problems.within(name):
        per_value = _version(file, name) == 2
        before = len(problems.found)
        specs, n_samples = _signals(file, name, problems, values)
        if per_value:
            _check_details(file, name, problems, values)
        plant, about, events = _plant(file, name, problems), _about(file, name, problems), _events(file, name, problems)
        if len(problems.found) == before:
            return FileContents(Header(specs, plant, **about, per_value=per_value), n_samples, events)
    return None


def header_of(file: h5py.File, name: str) -> Header:
    """What an open file declares of its signals and itself, whatever their lengths. Raises BadInput."""
    problems = Problems(keep_going=False)
    per_value = _version(file, name) == 2
    specs, _ = _signals(file, name, problems, values=False, lengths=False)
    return Header(specs, _plant(file, name, problems), **_about(file, name, problems), per_value=per_value)


def events_of(file: h5py.File, name: str) -> tuple[Event, ...]:
    """The events of an open file; none where they cannot be read."""
    return _events(file, name, Problems(keep_going=True))


def _version(file: h5py.File, name: str) -> int:
    """The version of a file of the format. Raises BadInput for any other."""
    given = text_attribute(file, "format", name)
    if given != FORMAT:
        found = "the root attribute format is missing" if given is None else f"its format is '{given}'"
        remedy = f"a recording says format = '{FORMAT}'; import other files into one first"
        raise BadInput(name, found, remedy, parameter="import_to")
    version = number_attribute(file, "version", name)
    if not isinstance(version, int) or version not in VERSIONS:
        found = "the root attribute version is missing" if version is None else f"its version is {version}"
        newer = version is not None and version > VERSIONS[-1]
        remedy = "update this program, or write the file as version 1" if newer else "the version is an integer"
        raise BadInput(name, found, f"this program reads versions {' and '.join(map(str, VERSIONS))}; {remedy}")
    return version


def _signals(
    file: h5py.File, name: str, problems: Problems, values: bool, lengths: bool = True
) -> tuple[tuple[SignalSpec, ...], int]:
    where = f"{name}: /signals"
    if "signals" not in file:
        raise BadInput(where, "the group is missing", "a recording holds its signals there, one dataset each")
    group = member(file, "signals", h5py.Group, where)
    specs, found = [], dict[str, int]()
    for signal in group:
        item = f"{where}/{signal}"
        with problems.within(item):
            dataset = member(group, signal, h5py.Dataset, item)
            found[signal] = _length(dataset, item)
            specs.append(_spec(dataset, signal, item))
    if lengths:
        _check_lengths(found, where, problems)
    if values and "time" in found:
        _check_values(group, specs, found, where, problems)
    clash = signals_problem(specs) if len(specs) == len(group) else None
    if clash:
        problems.add(f"{name}: {clash[0]}", *clash[1:])
    return tuple(specs), found.get("time", 0)


def _check_details(file: h5py.File, name: str, problems: Problems, values: bool) -> None:
    """The groups of version 2: for every signal but the clock its quality and its reply times."""
    for group in ("quality", "reply_times"):
        with problems.within(f"{name}: /{group}"):
            if group not in file:
                raise BadInput(f"{name}: /{group}", "the group is missing", "a recording of version 2 has it")
            parent = member(file, group, h5py.Group, f"{name}: /{group}")
            for signal in file["signals"]:
                if signal != "time":
                    _check_detail(file, parent, signal, f"{name}: /{group}/{signal}", problems, values)


def _check_detail(
    file: h5py.File, parent: h5py.Group, signal: str, item: str, problems: Problems, values: bool
) -> None:
    with problems.within(item):
        if signal not in parent:
            raise BadInput(item, "the dataset is missing", "in version 2 every signal but time has one")
        dataset = member(parent, signal, h5py.Dataset, item)
        n_samples = len(member(file["signals"], signal, h5py.Dataset, item))
        if _length(dataset, item) != n_samples:
            found = f"it has {len(dataset)} values, the signal has {n_samples}"
            raise BadInput(item, found, "there is one for each sample")
        problem = codes_problem(numbers_of(dataset)) if values and "/quality/" in item else None
        if problem:
            raise BadInput(item, *problem)


def _check_values(
    group: h5py.Group, specs: list[SignalSpec], lengths: dict[str, int], where: str, problems: Problems
) -> None:
    """Judge the samples, the others of a wrong clock only where they are few: a small file may declare any number."""
    before, few = len(problems.found), max(lengths.values()) <= CLOCK_ROWS
    with problems.within(f"{where}/time"):
        clock_of(group["time"], f"{where}/time")
    for spec in specs if few or len(problems.found) == before else ():
        item = f"{where}/{spec.name}"
        with problems.within(item):
            same = spec.name != "time" and lengths[spec.name] == lengths["time"]
            problem = value_problem(spec.role, numbers_of(group[spec.name])) if same else None
            if problem:
                raise BadInput(item, *problem)


def _length(dataset: h5py.Dataset, where: str) -> int:
    if dataset.dtype.kind not in "iuf":
        found = f"its values are of type {dataset.dtype}"
        raise BadInput(where, found, "a signal holds integers or floating-point numbers")
    check_column(dataset, where)
    return cast(int, dataset.shape[0])


def _check_lengths(lengths: dict[str, int], where: str, problems: Problems) -> None:
    if "time" not in lengths:
        return
    n_samples = lengths["time"]
    if n_samples < 2:
        problems.add(f"{where}/time", f"there are {n_samples} samples", "a recording holds at least 2")
    for signal, length in lengths.items():
        if length != n_samples:
            found = f"it has {length} samples, time has {n_samples}"
            remedy = "all signals of a recording have one length; missing samples are NaN"
            problems.add(f"{where}/{signal}", found, remedy)


def _spec(dataset: h5py.Dataset, signal: str, where: str) -> SignalSpec:
    unit, role = text_attribute(dataset, "unit", where), text_attribute(dataset, "role", where)
    if unit is None:
        raise BadInput(where, "the attribute unit is missing", "every signal says its unit: m, N, Pa, % or 1 ...")
    if role is None:
        raise BadInput(where, "the attribute role is missing", f"every signal says its role: {', '.join(ROLES)}")
    problem = unit_problem(signal, unit)
    if problem:
        raise BadInput(where, *problem)
    numbers = {key: number_attribute(dataset, key, where) for key in ("resolution", "noise_std")}
    try:
        return SignalSpec(signal, unit, cast(Role, role), text_attribute(dataset, "description", where), **numbers)
    except BadInput as wrong:
        raise BadInput(where, wrong.found, wrong.remedy) from None


def _plant(file: h5py.File, name: str, problems: Problems) -> Plant:
    known: dict[str, Any] = {}
    with problems.within(f"{name}: /plant"):
        if "plant" not in file:
            return Plant()
        group = member(file, "plant", h5py.Group, f"{name}: /plant")
        for key in PLANT_NAMES:
            where = f"{name}: /plant: {key}"
            with problems.within(where):
                value = raw_attribute(group, key)
                if value is NOT_PLAIN:
                    raise BadInput(where, "it is neither one text nor one number", "store it as one value")
                problem = None if value is None else plant_problem(key, value)
                if problem:
                    raise BadInput(where, *problem)
                known[key] = value
    return Plant(**known)


def _about(file: h5py.File, name: str, problems: Problems) -> dict[str, Any]:
    about: dict[str, Any] = {}
    with problems.within(f"{name}: attribute title"):
        about["title"] = text_attribute(file, "title", name)
    with problems.within(f"{name}: attribute source"):
        about["source"] = _source(text_attribute(file, "source", name), name)
    with problems.within(f"{name}: attribute created"):
        about["created"] = _created(text_attribute(file, "created", name), name)
    with problems.within(name):
        about["attributes"] = dict(_further(file, name))
    return about


def _source(text: str | None, name: str) -> str | None:
    if text is not None and text not in ORIGINS:
        raise BadInput(f"{name}: attribute source", f"it is '{text}'", f"allowed: {', '.join(ORIGINS)}")
    return text


def _created(text: str | None, name: str) -> datetime | None:
    try:
        created = None if text is None else datetime.fromisoformat(text)
    except ValueError:
        created = None
    problem = None if text is None or (created and created.tzinfo) else created_problem(text)
    if problem:
        raise BadInput(f"{name}: attribute created", *problem)
    return created


def _further(file: h5py.File, name: str) -> Iterator[tuple[str, str | float]]:
    """The attributes beyond the format that are one text or number; anything else is not ours to keep."""
    for key in file.attrs:
        if key not in RESERVED:
            value = raw_attribute(file, key)
            if isinstance(value, (str, int, float)) and not isinstance(value, bool):
                problem = attribute_problem(key, value)
                if problem:
                    raise BadInput(f"{name}: attribute {key}", *problem)
                yield key, value


def _events(file: h5py.File, name: str, problems: Problems) -> tuple[Event, ...]:
    where = f"{name}: /events"
    with problems.within(where):
        if "events" not in file:
            return ()
        group = member(file, "events", h5py.Group, where)
        if not len(group):
            return ()
        times, kinds, texts = (_event_column(group, key, where) for key in ("time", "kind", "text"))
        if not len(times) == len(kinds) == len(texts):
            found = f"its columns have {len(times)} times, {len(kinds)} kinds and {len(texts)} texts"
            raise BadInput(where, found, "each event has one of each")
        return tuple(_event(where, row, *event) for row, event in enumerate(zip(times, kinds, texts, strict=True)))
    return ()


def _event(where: str, row: int, time: float, kind: str, text: str) -> Event:
    try:
        return Event(time, kind, text)
    except BadInput as wrong:
        raise BadInput(where, f"row {row}: {wrong.found}", wrong.remedy) from None


def _event_column(group: h5py.Group, key: str, where: str) -> list[Any]:
    item = f"{where}/{key}"
    if key not in group:
        raise BadInput(item, "the dataset is missing", "events have the columns time (s), kind and text")
    dataset = member(group, key, h5py.Dataset, item)
    check_column(dataset, item)
    if key == "time":
        if dataset.dtype.kind not in "iuf":
            raise BadInput(item, f"its values are of type {dataset.dtype}", "the times of events are numbers, in s")
        return cast("list[Any]", numbers_of(dataset).tolist())
    if h5py.check_string_dtype(dataset.dtype) is None:
        raise BadInput(item, f"its values are of type {dataset.dtype}", "kinds and texts of events are strings")
    return cast("list[Any]", dataset.asstr()[:].tolist())
