"""What a user says about a foreign file: which column is which signal, in what unit. From options or a TOML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, ValidationError, field_validator, model_validator

from recordings.column_headers import did_you_mean
from recordings.errors import BadInput
from recordings.hdf5.header import Origin
from recordings.importers.dates import ISO, NAMED
from recordings.plant import PLANT_NAMES
from recordings.signal import Role
from recordings.text_files import read_small_toml
from recordings.units import UNITS, find_unit

_READY = Path(__file__).parent.parent / "mappings"
_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}

_RIVALS: Mapping[str, tuple[str, ...]] = {
    "rate_hz": ("column", "unit", "format"), "column": ("rate_hz", "unit", "format"), "format": ("unit",),
}  # fmt: skip
"""What a new source of time replaces in the old one."""

Column = Annotated[str | int, Field(description="name of a column, or its number from 1")]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Reverse(_Strict):
    """Rows to turn round: those with `value` in the text column `column` were listed against their order in time."""

    column: Column
    value: str


class FileLayout(_Strict):
    """How a table is laid out in its file; what is left open is guessed. Only `variable` concerns .mat files."""

    separator: str = "auto"
    decimal: Literal[".", ","] = "."
    thousands: Literal["", ".", ",", "'", " "] = ""
    header: bool | None = None
    comment: str = "#"
    encoding: str | None = None
    skip_lines: int = Field(default=0, ge=0)
    drop_rows: int = Field(default=0, ge=0)
    columns: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    variable: str | None = None
    reverse: Reverse | None = None

    @property
    def separator_sign(self) -> str | None:
        """The separating character, None when it is to be guessed."""
        return None if self.separator == "auto" else _SEPARATORS.get(self.separator, self.separator)

    @field_validator("separator")
    @classmethod
    def _one_character(cls, value: str) -> str:
        if value not in {"auto", *_SEPARATORS} and len(value) != 1:
            raise ValueError(f"'{value}' is no separator; allowed: auto, {', '.join(_SEPARATORS)} or one character")
        return value

    @model_validator(mode="after")
    def _signs_differ(self) -> FileLayout:
        if self.decimal in {self.thousands, self.separator_sign}:
            raise ValueError(f"the decimal sign '{self.decimal}' is also the separator or the sign of thousands")
        return self


class TimeAxis(_Strict):
    """Where time comes from: a column, or a rate for evenly spaced rows.

    of_day : the column with the time of day, where that stands beside a column of dates.
    """

    column: Column | None = None
    of_day: Column | None = None
    unit: str | None = None
    format: str | None = None
    rate_hz: PositiveFloat | None = None
    repair: Literal["refuse", "drop", "sort"] = "refuse"
    from_s: float | None = None
    until_s: float | None = None

    @model_validator(mode="after")
    def _one_source(self) -> TimeAxis:
        if self.column is not None and self.rate_hz is not None:
            raise ValueError("time comes from a column or from a rate (rate_hz), not from both")
        if self.of_day is not None and (self.column is None or self.unit != "iso8601"):
            raise ValueError("a time of day (of_day) stands beside a column of dates with the unit iso8601")
        return self

    @property
    def date_format(self) -> str | None:
        """How dates are written, as `dates.date_of` takes it; None where time is a number."""
        return self.format or (ISO if self.unit == ISO else None)

    @field_validator("format")
    @classmethod
    def _of_dates(cls, value: str | None) -> str | None:
        if value is not None and value not in NAMED and "%" not in value:
            raise ValueError(
                f"'{value}' is no format of dates; allowed: {', '.join(NAMED)} or one as %d.%m.%Y %H:%M:%S"
            )
        return value

    @field_validator("unit")
    @classmethod
    def _of_time(cls, value: str | None) -> str | None:
        known = find_unit(value) if value else None
        if value not in {None, "iso8601"} and (known is None or known.si != "s"):
            units = ", ".join(symbol for symbol, one in UNITS.items() if one.si == "s")
            raise ValueError(f"'{value}' is not a unit of time; allowed: {units}, iso8601")
        return value


class SignalSource(_Strict):
    """One signal: a column or a formula, and what it is. `period` undoes the wrapping of a cyclic sensor."""

    column: Column | None = None
    formula: str | None = None
    unit: str | None = None
    role: Role | None = None
    description: str | None = None
    resolution: float | None = Field(default=None, ge=0)
    noise_std: float | None = Field(default=None, ge=0)
    period: PositiveFloat | None = None
    optional: bool = False

    @model_validator(mode="after")
    def _one_source(self) -> SignalSource:
        if (self.column is None) == (self.formula is None):
            raise ValueError("a signal comes from a column or from a formula: give one of the two")
        if self.formula is not None and self.unit is None:
            raise ValueError("a formula needs the unit of its result")
        return self


class ImportMapping(_Strict):
    """All that is said about a foreign file.

    carry : whether columns that are not named are taken along as extra signals when their unit is known.
    """

    title: str | None = None
    source: Origin | None = None
    carry: bool = True
    file: FileLayout = FileLayout()
    time: TimeAxis = TimeAxis()
    signals: dict[str, SignalSource] = {}
    plant: dict[str, float | str] = {}
    attributes: dict[str, str | int | float] = {}

    @field_validator("plant")
    @classmethod
    def _known_items(cls, value: dict[str, float | str]) -> dict[str, float | str]:
        for name in value:
            if name not in PLANT_NAMES:
                raise ValueError(f"'{name}' is not known of a plant; allowed: {', '.join(PLANT_NAMES)}")
        return value

    @field_validator("signals")
    @classmethod
    def _time_apart(cls, value: dict[str, SignalSource]) -> dict[str, SignalSource]:
        if "time" in value:
            raise ValueError("time is described in the section [time]")
        return value


def mapping_names() -> tuple[str, ...]:
    """The names of the ready mappings."""
    return tuple(sorted(file.stem for file in _READY.glob("*.toml")))


def load_mapping(name: str | Path) -> ImportMapping:
    """A ready mapping by its name, or one from a TOML file.

    Raises
    ------
    BadInput
        There is none of that name, the file is no TOML, or it says something unknown, naming the place.
    """
    path = _READY / f"{name}.toml" if str(name) in mapping_names() else Path(name)
    if not path.exists():
        close = did_you_mean(str(name), mapping_names())
        remedy = f"{close}{' ' if close else ''}give a TOML file or one of: {', '.join(mapping_names())}"
        raise BadInput(str(name), "there is no such mapping", remedy)
    values = read_small_toml(path, "see docs/recordings.md for an example")
    return mapping_of(values, str(path))


def mapping_of(values: Mapping[str, Any], where: str) -> ImportMapping:
    """The mapping that nested dictionaries describe; `BadInput` naming the place of what is not allowed."""
    try:
        return ImportMapping.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        raise BadInput(*_in_words(first, where)) from None


def with_changes(base: ImportMapping, changes: Mapping[str, Any], where: str) -> ImportMapping:
    """A mapping with some of its values replaced; signals are replaced whole, by name. None says nothing.

    A column of time and a rate replace each other.
    """
    values = base.model_dump(exclude_unset=True)
    for section, change in changes.items():
        if isinstance(change, Mapping):
            said = {key: value for key, value in change.items() if value is not None}
            rivals = {rival for key in said for rival in _RIVALS.get(key, ())} if section == "time" else set()
            kept = {key: value for key, value in values.get(section, {}).items() if key not in rivals}
            values[section] = kept | said
        elif change is not None:
            values[section] = change
    return mapping_of(values, where)


def _in_words(error: Any, where: str) -> tuple[str, str, str]:
    place = [str(part) for part in error["loc"] if part not in {"str", "int", "float"}]
    name = f"{where}: {'.'.join(place)}" if place else where
    if error["type"] == "extra_forbidden":
        return name, "this key is not known", f"known there: {', '.join(_known_keys(place[:-1]))}"
    message = str(error["msg"]).removeprefix("Value error, ")
    found, _, remedy = message.partition("; ")
    given = f" (found {error['input']!r})" if isinstance(error.get("input"), (str, int, float, bool)) else ""
    return name, found + ("" if remedy else given), remedy or "see docs/recordings.md for what a mapping holds"


def _known_keys(place: Sequence[str]) -> list[str]:
    models: dict[str, type[BaseModel]] = {"file": FileLayout, "time": TimeAxis, "signals": SignalSource}
    model = models.get(place[0], ImportMapping) if place else ImportMapping
    return list((Reverse if "reverse" in place else model).model_fields)
