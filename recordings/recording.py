"""A recording: one experiment on one plant, as an immutable value."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from datetime import datetime
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recordings.array_signals import DataFrameLike, arrays_of_frame, signals_of_arrays
from recordings.arrays import Array
from recordings.errors import BadInput
from recordings.exchange.data_frames import frame_of, table_of_frame
from recordings.exchange.table_form import parts_of_table, table_of
from recordings.hdf5.header import Header, Origin
from recordings.plant import Event, Plant
from recordings.sample_checks import clock_problem, codes_problem, size_problem, value_problem
from recordings.signal import UNDERSTOOD, Role, Signal
from recordings.views import pictures

Codes = NDArray[np.uint8]
"""The quality of each value, shape (n_samples,): codes of `QUALITIES`."""


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """One experiment on one plant: signals of one length over one clock, and what is known about them.

    signals : by name, of n_samples values each, exactly one of them `time` [s], strictly increasing;
    plant : what is known of it; title : one line; source : one of `ORIGINS`; created : with time zone;
    events : what happened; attributes : further texts and numbers, kept; path : the file it came from;
    quality, reply_times : by signal, what is known of each value of a device (format version 2): codes of `QUALITIES`,
    and when the reply came that brought it [s]; empty where nothing is known.

    Raises `BadInput` naming the item when the parts do not make a valid recording.

    >>> import numpy as np
    >>> clock = Signal("time", np.array([0.0, 0.1, 0.2]), "s", "time")
    >>> travel = Signal("position", np.array([0.0, 1.0, 2.0]), "mm", "output")
    >>> recording = Recording.of([clock, travel], title="first steps")
    >>> len(recording), "force" in recording, recording.si("position").values[2]
    (3, False, np.float64(0.002))
    """

    signals: Mapping[str, Signal]
    plant: Plant = field(default_factory=Plant)
    title: str | None = None
    source: Origin | None = None
    created: datetime | None = None
    events: tuple[Event, ...] = ()
    attributes: Mapping[str, str | float] = field(default_factory=dict)
    path: Path | None = None
    quality: Mapping[str, Codes] = field(default_factory=dict)
    reply_times: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in _MAPPINGS:
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))
        object.__setattr__(self, "events", tuple(self.events))
        problem = _mapping_problem(self.signals) or _details_problem(self)
        if problem:
            raise BadInput(f"{self.label}: {problem[0]}", *problem[1:])
        _ = self.header  # building it checks the rest

    @classmethod
    def of(cls, signals: Iterable[Signal], **about: Any) -> Recording:
        """A recording of these signals; `about` are the other fields."""
        return cls({signal.name: signal for signal in signals}, **about)

    @classmethod
    def from_arrays(
        cls,
        *,
        time: ArrayLike,
        position: ArrayLike | None = None,
        force: ArrayLike | None = None,
        pressure: ArrayLike | None = None,
        setpoint: ArrayLike | None = None,
        drive: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        flow: ArrayLike | None = None,
        temperature: ArrayLike | None = None,
        supply_pressure: ArrayLike | None = None,
        upstream_pressure: ArrayLike | None = None,
        downstream_pressure: ArrayLike | None = None,
        extra: Mapping[str, ArrayLike] | None = None,
        units: Mapping[str, str] | None = None,
        roles: Mapping[str, Role] | None = None,
        plant: Plant | Mapping[str, float | str] | None = None,
        title: str | None = None,
        source: Origin | None = None,
    ) -> Recording:
        """A recording of arrays: one value a sample, shape (n_samples,), NaN where a sample is missing.

        Parameters
        ----------
        time : array_like
            Strictly increasing [s]; times of day (datetime64) become seconds since the first.
        position, force, pressure, ... : array_like, optional
            The signals of these names, in the units of `UNDERSTOOD`: SI, but flow in m3/h and temperature in degC.
        extra : mapping, optional
            Signals of any other name; each needs a unit.
        units : mapping, optional
            Units by signal where they are others, as ``{"position": "mm", "pressure": "kPa"}``. Values are converted.
        roles : mapping, optional
            Roles by signal. Without one, setpoint, drive, pressure and force are inputs, the position is the output,
            and all others are extra.
        plant : Plant or mapping, optional
            What is known of the valve. With its ``stroke_m`` a position in % becomes metres.
        title, source : str, optional
            One line for plots and reports; where it is from: ``plant``, ``rig`` or ``simulated``.

        Raises
        ------
        BadParameter, BadInput
            The arrays differ in length, the time does not increase, a unit is not known or does not fit, or a unit or
            a role is given for a signal that is not there.

        >>> recording = Recording.from_arrays(
        ...     time=[0.0, 0.1, 0.2], position=[10.0, 10.5, 11.0], force=[100, 150, 200], units={"position": "mm"}
        ... )
        >>> recording["position"].values[1], recording["position"].unit, recording["force"].role
        (np.float64(0.0105), 'm', 'input')
        """
        named = {
            "time": time, "setpoint": setpoint, "drive": drive, "pressure": pressure,
            "supply_pressure": supply_pressure, "force": force, "position": position, "velocity": velocity,
            "flow": flow, "upstream_pressure": upstream_pressure, "downstream_pressure": downstream_pressure,
            "temperature": temperature,
        }  # fmt: skip
        arrays = {name: array for name, array in named.items() if array is not None} | dict(extra or {})
        known = Plant.of(plant)
        return cls.of(signals_of_arrays(arrays, units, roles, known.stroke_m), plant=known, title=title, source=source)

    @classmethod
    def from_dataframe(
        cls,
        frame: DataFrameLike,
        *,
        columns: Mapping[str, Hashable] | None = None,
        units: Mapping[str, str] | None = None,
        roles: Mapping[str, Role] | None = None,
        plant: Plant | Mapping[str, float | str] | None = None,
        title: str | None = None,
        source: Origin | None = None,
    ) -> Recording:
        """A recording of columns of a data frame, of pandas or of anything else with ``.columns`` and ``to_numpy()``.

        columns : label of the column of each signal, as ``{"position": "stem travel"}``; without it, the columns whose
        header says a known name, and perhaps a unit: ``time``, ``Position [mm]``, ``force (N)``, ``pressure_kPa``.
        The rest as in `from_arrays`; units given here go before those in the headers.

        A frame that `to_dataframe` made carries what its columns cannot say, so nothing else need be given, and
        nothing is lost; its rows and values are taken as they are now, columns that it did not have are left out.

        Raises `BadParameter` for a column that is not there and when no column is the time, else as `from_arrays`.
        """
        whole = None if any((columns, units, roles, plant, title, source)) else table_of_frame(frame)
        if whole is not None:
            return cls(**parts_of_table(whole, "the data frame"))
        arrays, symbols = arrays_of_frame(frame, columns, units)
        known = Plant.of(plant)
        signals = signals_of_arrays(arrays, symbols, roles, known.stroke_m)
        return cls.of(signals, plant=known, title=title, source=source)

    def to_arrays(self) -> dict[str, Array]:
        """The values of all signals by name, shape (n_samples,) each, read-only, in the units that they are stored in.

        ``recording.si(name)`` has the unit beside the values, and converts them to SI.
        """
        return {name: signal.values for name, signal in self.signals.items()}

    def to_dataframe(self) -> Any:
        """A pandas data frame: a column for each signal, by name, in the unit that it is stored in.

        Qualities and reply times of single values are columns ``quality/NAME`` and ``reply_time/NAME``. All else is
        carried in ``frame.attrs``, so `from_dataframe` makes the same recording again. Raises `BadInput` where pandas
        is not installed.
        """
        return frame_of(table_of(self))

    def to_dict(self) -> dict[str, Any]:
        """The arguments with which `from_arrays` makes this recording again.

        Descriptions, resolutions, noise, events and further attributes have no place there.

        >>> recording = Recording.from_arrays(time=[0.0, 0.1], position=[0.5, 0.6], units={"position": "%"})
        >>> Recording.from_arrays(**recording.to_dict()).si("time").values
        array([0. , 0.1])
        """
        arrays = self.to_arrays()
        others = {name: arrays.pop(name) for name in self.signals if name not in UNDERSTOOD}
        about = {"plant": self.plant, "title": self.title, "source": self.source}
        units = {name: signal.unit for name, signal in self.signals.items()}
        roles = {name: signal.role for name, signal in self.signals.items()}
        return {**arrays, "extra": others, "units": units, "roles": roles, **about}

    def __getitem__(self, name: str) -> Signal:
        """The signal of a name; `BadInput` listing those there when it has none."""
        if name not in self.signals:
            there = ", ".join(self.signals)
            raise BadInput(self.label, f"it has no signal '{name}'", f"signals there: {there}")
        return self.signals[name]

    def __contains__(self, name: object) -> bool:
        return name in self.signals

    def __iter__(self) -> Iterator[str]:
        return iter(self.signals)

    def __repr__(self) -> str:
        labels = ", ".join(signal.spec.label for signal in self.signals.values())
        return f"<Recording {self.label}: {len(self)} samples of {labels}>"

    def _repr_html_(self) -> str:
        return pictures.table(self)

    def plot(self) -> Any:
        """Every signal over time, and the loop of force and position, as a bokeh layout."""
        return pictures.picture_of(self)

    def __len__(self) -> int:
        """The number of samples."""
        return len(self.signals["time"])

    def __reduce__(self) -> tuple[type[Recording], tuple[Any, ...]]:
        """Pickle as plain dictionaries: read-only views of them cannot be sent to another process."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        values |= {name: dict(getattr(self, name)) for name in _MAPPINGS}
        return type(self), tuple(values.values())

    @property
    def time(self) -> Array:
        """The clock [s], shape (n_samples,), strictly increasing."""
        return self.signals["time"].values

    @property
    def label(self) -> str:
        """What to call it in a message: its file, else its title."""
        return str(self.path or self.title or "recording")

    @property
    def header(self) -> Header:
        """Everything but samples and events."""
        specs = tuple(signal.spec for signal in self.signals.values())
        about = (self.plant, self.title, self.source, self.created, self.attributes)
        return Header(specs, *about, per_value=bool(self.quality))

    def si(self, name: str) -> Signal:
        """The signal of a name in SI units; a position in % becomes metres with the plant's stroke.

        Raises `BadInput` when there is no such signal, its unit is not known, or the stroke is needed and not known.
        """
        signal = self[name]
        self.check(name)
        try:
            return signal.si(self.plant.stroke_m)
        except BadInput as problem:
            raise BadInput(f"{self.label}: {problem.where}", problem.found, problem.remedy) from None

    def check(self, *names: str) -> None:
        """Raise `BadInput` where the clock or the named signals, every one when none is named, cannot be computed with:
        infinite or immense values, steps of time shorter than a nanosecond, times beyond thousands of years.
        """
        if self._clock_problem:
            raise BadInput(f"{self.label}: /signals/time", *self._clock_problem)
        for name in names or self.signals:
            problem = size_problem(self[name].values)
            if problem:
                raise BadInput(f"{self.label}: /signals/{name}", *problem)

    @cached_property
    def _clock_problem(self) -> tuple[str, str] | None:
        return clock_problem(self.time)

    @cached_property
    def sha256(self) -> str | None:
        """Hexadecimal SHA-256 of the file it came from; None when it came from none, or the file is there no more.
        Computed when first asked for.
        """
        if self.path is None:
            return None
        try:
            with self.path.open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
        except OSError:  # a long fit is not lost because its recording was moved meanwhile
            return None


_MAPPINGS = ("signals", "attributes", "quality", "reply_times")


def _details_problem(recording: Recording) -> tuple[str, str, str] | None:
    """What is wrong with the quality and the reply times of the values."""
    names = {name for name in recording.signals if name != "time"}
    for group in ("quality", "reply_times"):
        arrays: Mapping[str, NDArray[Any]] = getattr(recording, group)
        if (recording.quality or recording.reply_times) and set(arrays) != names:
            return (
                f"/{group}",
                f"it has {', '.join(arrays) or 'nothing'}",
                "give it for every signal but time, or for none",
            )
        for name, values in arrays.items():
            if values.shape != recording.signals["time"].values.shape:
                return f"/{group}/{name}", f"it has the shape {values.shape}", "there is one for each sample"
            problem = codes_problem(values) if group == "quality" else None
            if problem:
                return f"/{group}/{name}", *problem
    return None


def _mapping_problem(signals: Mapping[str, Signal]) -> tuple[str, str, str] | None:
    for name, signal in signals.items():
        if signal.name != name:
            return f"/signals/{name}", f"it holds the signal '{signal.name}'", "a signal is stored under its own name"
    if "time" not in signals:
        return "/signals", "there is no signal named 'time'", "give one, in s, with the role 'time'"
    n_samples = len(signals["time"])
    if n_samples < 2:
        return "/signals", f"there are {n_samples} samples", "a recording holds at least 2"
    for name, signal in signals.items():
        if len(signal) != n_samples:
            found = f"it has {len(signal)} samples, time has {n_samples}"
            return f"/signals/{name}", found, "all signals have one length"
        problem = value_problem(signal.role, signal.values)
        if problem:
            return f"/signals/{name}", *problem
    return None
