"""The plant file: which valves a service watches, where their values come from, and where everything goes.

One TOML file, checked whole before anything is opened; docs/files.md has every key. Paths in it are relative to the
file's own folder. Nothing in it is ever executed: a program for events is named on the command line only.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from recordings import BadInput, file_of, read_small_toml

LARGEST_FILE = 1_000_000
MOST_VALVES = 500

_Text = Annotated[str, Field(min_length=1, max_length=500)]
_Listen = Annotated[str, Field(pattern=r"^(\[[0-9a-fA-F:.]+\]|[A-Za-z0-9.-]+):[0-9]{1,5}$")]


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=False)


class ValveEntry(_Entry):
    """One valve. tag : its name; map : a register map's file or shipped name, None for a recording; unit : device id;
    model : `model.json` of a fit or trace; learn_s : learning time [s] when nothing is known of it; calibrate :
    recordings of it in good order to learn from instead.
    """

    tag: Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[A-Za-z0-9_+()-][A-Za-z0-9_+().\- ]*$")]
    model: _Text
    map: _Text | None = None
    unit: Annotated[int, Field(ge=1, le=247)] | None = None
    learn_s: Annotated[float, Field(ge=1.0, le=1e8)] = 3600.0
    calibrate: tuple[_Text, ...] = ()


class SourceEntry(_Entry):
    """One address and the valves behind it. rate_hz : rounds a second; ring : fetch every sample of the device's ring;
    heartbeat : point that must change, instead of the map's own, within heartbeat_s [s].
    """

    address: _Text
    valve: Annotated[tuple[ValveEntry, ...], Field(min_length=1)]
    rate_hz: Annotated[float, Field(ge=1e-4, le=1e4)] = 10.0
    ring: bool = False
    heartbeat: _Text | None = None
    heartbeat_s: Annotated[float, Field(ge=1e-3, le=1e6)] = 2.0


class RecordingEntry(_Entry):
    """Where everything is recorded. rotate_hours, rotate_mb : when a new file is begun."""

    folder: _Text
    rotate_hours: Annotated[float, Field(ge=1e-3, le=1e5)] = 24.0
    rotate_mb: Annotated[float, Field(ge=0.01, le=1e6)] | None = None


class MqttEntry(_Entry):
    """A broker that events go to, under ``topic/TAG``. password_file : its first line; ca : for TLS (PEM)."""

    host: _Text
    port: Annotated[int, Field(ge=1, le=65535)] = 1883
    topic: Annotated[str, Field(pattern=r"^[^#+\x00]{1,200}$")] = "bristle"
    username: _Text | None = None
    password_file: _Text | None = None
    ca: _Text | None = None


class EventsEntry(_Entry):
    """Where events go. file : JSON lines are appended to it."""

    file: _Text | None = None
    mqtt: MqttEntry | None = None


class MetricsEntry(_Entry):
    """Where Prometheus finds the metrics. expose : whether other machines may reach it."""

    listen: _Listen = "127.0.0.1:9108"
    expose: bool = False


class PageEntry(_Entry):
    """Where the live page is. expose : whether other machines may reach it, with a token and TLS then."""

    listen: _Listen = "127.0.0.1:8050"
    expose: bool = False
    token_file: _Text | None = None
    certificate: _Text | None = None
    key: _Text | None = None

    @model_validator(mode="after")
    def _guarded(self) -> Self:
        if self.expose and not (self.token_file and self.certificate and self.key):
            raise ValueError("it is exposed without a guard; give token_file, certificate and key")
        return self


class PlantFile(_Entry):
    """A plant as its file has it. folder : of the file, what relative paths start from; state : folder for what is
    learned; false_alarms : allowed a month and valve; figures_every_s : how often in-service figures are updated [s].

    >>> PlantFile.parsed({"name": "Unit 7", "sources": []}, "plant.toml", Path())
    Traceback (most recent call last):
    recordings.errors.BadInput: plant.toml: sources: unknown key; did you mean 'source'? (and 1 more mistake)
    """

    name: _Text
    source: Annotated[tuple[SourceEntry, ...], Field(min_length=1)]
    state: _Text = "state"
    false_alarms: Annotated[float, Field(ge=1e-3, le=1e4)] = 1.0
    figures_every_s: Annotated[float, Field(ge=1.0, le=1e6)] = 600.0
    recordings: RecordingEntry | None = None
    events: EventsEntry = EventsEntry()
    metrics: MetricsEntry | None = None
    page: PageEntry | None = None
    file: Path = Field(default=Path("plant.toml"), exclude=True)

    @model_validator(mode="after")
    def _tags_differ(self) -> Self:
        tags = [valve.tag for one in self.source for valve in one.valve]
        if len(tags) > MOST_VALVES:
            raise ValueError(f"it has {len(tags)} valves; split it into files of at most {MOST_VALVES}")
        for tag in tags:
            if tags.count(tag) > 1:
                raise ValueError(f"the tag '{tag}' is there twice; give each valve its own")
        return self

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a plant file. Raises BadInput naming the file, the item and the remedy."""
        where = Path(path)
        content = read_small_toml(where, "give a plant file (.toml); docs/files.md has every key", LARGEST_FILE)
        return cls.parsed(content, str(path), where)

    @classmethod
    def parsed(cls, content: Mapping[str, Any], where: str, file: Path) -> Self:
        """The content of a plant file. Raises BadInput for the first thing that is wrong, with how many more."""
        if "file" in content:
            raise BadInput(f"{where}: file", "unknown key", "remove it")
        try:
            return cls.model_validate({**content, "file": file})
        except ValidationError as error:
            raise _bad_input(error.errors(), where) from None

    def path(self, text: str) -> Path:
        """A path of the file, from the file's own folder on."""
        return self.file.parent / text

    def recording(self, text: str) -> Path:
        """The same for a recording, which may also be ``bundled:NAME``. Raises BadInput for no such name."""
        return file_of(text, self.file.parent)


def _bad_input(errors: list[ErrorDetails], where: str) -> BadInput:
    """A pydantic error in our words."""
    first = min(errors, key=lambda one: one["type"] != "extra_forbidden")  # an unknown key explains a missing one
    place = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in first["loc"]).lstrip(".")
    text = str(first["msg"]).removeprefix("Value error, ")
    found, _, remedy = text.partition("; ")
    remedy = remedy or "correct it; docs/files.md has every key"
    if first["type"] == "extra_forbidden":
        found, remedy = "unknown key", _alike(first)
    elif first["type"] == "missing":
        found, remedy = "it is missing", "give it"
    elif first["type"] != "value_error":
        found += f" (found {first['input']!r:.60})"
    more = f" (and {len(errors) - 1} more mistake{'s' if len(errors) > 2 else ''})" if len(errors) > 1 else ""
    return BadInput(f"{where}: {place}" if place else where, found, remedy + more)


_TABLES: Mapping[str, type[BaseModel]] = {
    "valve": ValveEntry, "source": SourceEntry, "recordings": RecordingEntry, "mqtt": MqttEntry, "events": EventsEntry,
    "metrics": MetricsEntry, "page": PageEntry,
}  # fmt: skip


def _alike(error: ErrorDetails) -> str:
    """A known key of the same table that is spelled much like an unknown one, or all of them."""
    names = [str(step) for step in error["loc"] if not isinstance(step, int)]
    table = _TABLES.get(names[-2], PlantFile) if len(names) > 1 else PlantFile
    own = {"file"} if table is PlantFile else set()  # where it was read from, which no file says
    known = sorted(set(table.model_fields) - own)
    close = difflib.get_close_matches(names[-1], known, n=1, cutoff=0.6)
    return f"did you mean {close[0]!r}?" if close else f"allowed are {', '.join(known)}"
