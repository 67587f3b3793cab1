"""A recording as columns and one text: the form in which other programs keep all of it.

Columns are the signals by name, in the units that they are stored in, ``quality/NAME`` and ``reply_time/NAME`` what is
known of each value; no signal has a slash in its name. The text is JSON and holds everything else.
"""

from __future__ import annotations

import json
import numbers
from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from recordings.arrays import Array
from recordings.errors import BadInput
from recordings.hdf5.header import Header
from recordings.plant import Event, Plant
from recordings.signal import Signal, SignalSpec

Number = int | float
QUALITY, REPLY_TIME = "quality/", "reply_time/"
REMEDY = "export the recording again, or import the columns with options"


class WholeTable(NamedTuple):
    """Columns by name, shape (n_samples,) each, and the text about them."""

    columns: dict[str, NDArray[Any]]
    about: str


class RecordedParts(Protocol):
    """What is taken from a recording."""

    @property
    def header(self) -> Header: ...
    @property
    def signals(self) -> Mapping[str, Signal]: ...
    @property
    def events(self) -> tuple[Event, ...]: ...
    @property
    def quality(self) -> Mapping[str, NDArray[np.uint8]]: ...
    @property
    def reply_times(self) -> Mapping[str, Array]: ...


class _Spec(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    name: str
    unit: str
    role: Literal["time", "input", "output", "extra"]
    description: str | None = None
    resolution: float | None = None
    noise_std: float | None = None


class _Event(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    time: float
    kind: str
    text: str


class _About(BaseModel):
    """The text about a table."""

    model_config = ConfigDict(extra="forbid", strict=True)
    format: Literal["valve-recording-table"] = "valve-recording-table"
    version: Literal[1] = 1
    signals: tuple[_Spec, ...]
    plant: dict[str, Number | str] = {}
    title: str | None = None
    source: Literal["plant", "rig", "simulated"] | None = None
    created: str | None = None
    attributes: dict[str, Number | str] = {}
    events: tuple[_Event, ...] = ()


def table_of(recording: RecordedParts) -> WholeTable:
    """All of a recording but the path of its file."""
    header = recording.header
    columns: dict[str, NDArray[Any]] = {name: signal.values for name, signal in recording.signals.items()}
    columns |= {QUALITY + name: codes for name, codes in recording.quality.items()}
    columns |= {REPLY_TIME + name: times for name, times in recording.reply_times.items()}
    about = {
        "format": "valve-recording-table", "version": 1, "signals": [_plain(asdict(spec)) for spec in header.signals],
        "plant": _plain(header.plant.known()), "title": header.title, "source": header.source,
        "created": header.created and header.created.isoformat(), "attributes": _plain(header.attributes),
        "events": [_plain(asdict(event)) for event in recording.events],
    }  # fmt: skip
    return WholeTable(columns, json.dumps(about))


def parts_of_table(table: WholeTable, where: str) -> dict[str, Any]:
    """The arguments of `Recording` for a table; columns that the text does not name are left out.

    where : what to call it in a message. Raises BadInput for a text that is not as `table_of` writes it, and for a
    column that is not there.
    """
    try:
        about = _About.model_validate_json(table.about)
        created = about.created and datetime.fromisoformat(about.created)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "the whole text"
        raise BadInput(f"{where}: what is said about the recording", f"{place}: {first['msg']}", REMEDY) from error
    except ValueError as error:
        raise BadInput(f"{where}: created", f"it is no date ({error})", REMEDY) from error
    specs = [SignalSpec(**spec.model_dump()) for spec in about.signals]
    signals = {spec.name: Signal.of(spec, _column(table, spec.name, where)) for spec in specs}
    details = {
        field: {
            name: np.array(_column(table, prefix + name, where), kind)
            for name in signals
            if name != "time" and prefix + name in table.columns
        }
        for field, prefix, kind in (("quality", QUALITY, np.uint8), ("reply_times", REPLY_TIME, np.float64))
    }
    return {
        "signals": signals, "plant": Plant.of(about.plant), "title": about.title, "source": about.source,
        "created": created or None, "attributes": about.attributes,
        "events": tuple(Event(**event.model_dump()) for event in about.events), **details,
    }  # fmt: skip


def _column(table: WholeTable, name: str, where: str) -> NDArray[Any]:
    if name not in table.columns:
        raise BadInput(where, f"the column '{name}' is not there", REMEDY)
    try:
        return np.array(table.columns[name], np.float64)
    except (TypeError, ValueError) as error:
        raise BadInput(f"{where}: {name}", f"it holds something else than numbers ({error})", REMEDY) from error


def _plain(items: Mapping[str, Any]) -> dict[str, Any]:
    """Texts and numbers as JSON has them."""
    return {name: _value(value) for name, value in items.items()}


def _value(value: Any) -> Any:
    if isinstance(value, numbers.Integral):
        return int(value)
    return float(value) if isinstance(value, numbers.Real) else value
