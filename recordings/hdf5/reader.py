"""Reading recordings: whole, by signal, or only to say what is wrong with them. `/truth` is never opened here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType, TracebackType

import h5py
import numpy as np

from recordings.arrays import Array
from recordings.errors import BadInput
from recordings.hdf5.header import Header
from recordings.hdf5.items import clock_of, member, numbers_of
from recordings.hdf5.layout_reader import FileContents, layout_of
from recordings.hdf5.opening import open_hdf5
from recordings.hdf5.probe import probe
from recordings.hdf5.problems import Problems, h5py_errors
from recordings.plant import Event
from recordings.recording import Codes, Recording
from recordings.sample_checks import value_problem
from recordings.signal import Signal, SignalSpec


class RecordingFile:
    """An open recording: what it declares is known and checked, samples are read when asked for.

    Made by `open_recording`; a context manager.
    """

    def __init__(self, path: Path, file: h5py.File, layout: FileContents) -> None:
        self.path = path
        self._file, self._layout = file, layout

    def __enter__(self) -> RecordingFile:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def __len__(self) -> int:
        """The number of samples."""
        return self._layout.n_samples

    @property
    def header(self) -> Header:
        """Everything but samples and events."""
        return self._layout.header

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened during the recording."""
        return self._layout.events

    @property
    def specs(self) -> Mapping[str, SignalSpec]:
        """What the file declares of each signal, by name."""
        return MappingProxyType({spec.name: spec for spec in self.header.signals})

    def signal(self, name: str, *, may_be_missing: bool = False) -> Signal:
        """Read one signal; `BadInput` when there is none of that name or its values break a rule of the format.

        may_be_missing : whether an input or output without one number is accepted, to be looked at.
        """
        signal = self._unchecked(name)
        problem = None if may_be_missing and name != "time" else value_problem(signal.role, signal.values)
        if problem:
            raise BadInput(f"{self.path}: /signals/{name}", *problem)
        return signal

    def load(self, signals: Iterable[str] | None = None) -> Recording:
        """Read the named signals, and time always, into a recording; every signal when none is named."""
        wanted = self.specs if signals is None else dict.fromkeys(["time", *signals])
        clock = self._unchecked("time")  # first: where it is wrong nothing else is read
        header, about = self.header, [name for name in wanted if name != "time"] if self.header.per_value else []
        return Recording(
            signals={name: clock if name == "time" else self._unchecked(name) for name in wanted},
            plant=header.plant,
            title=header.title,
            source=header.source,
            created=header.created,
            events=self.events,
            attributes=header.attributes,
            path=self.path,
            quality={name: self.quality(name) for name in about},
            reply_times={name: self.reply_times(name) for name in about},
        )

    def quality(self, name: str) -> Codes:
        """The quality of each value of a signal of version 2: codes of `QUALITIES`, shape (n_samples,)."""
        return _values(self._file, "quality", name, str(self.path)).astype(np.uint8)

    def reply_times(self, name: str) -> Array:
        """When the reply came that brought each value of a signal of version 2 [s]; NaN where none did."""
        return _values(self._file, "reply_times", name, str(self.path))

    def _unchecked(self, name: str) -> Signal:
        if name not in self.specs:
            there = ", ".join(self.specs)
            raise BadInput(str(self.path), f"it has no signal '{name}'", f"signals there: {there}")
        return Signal.of(self.specs[name], _values(self._file, "signals", name, str(self.path)))

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        self._file.close()


def open_recording(path: str | Path) -> RecordingFile:
    """Open a recording without reading samples.

    Raises
    ------
    BadInput
        The file cannot be opened, or what it declares breaks a rule of the format.
    """
    path = Path(path)
    file = opened(path)
    try:
        layout = layout_of(file, str(path), Problems(keep_going=False))
        assert layout is not None  # the first problem is raised
    except BaseException:
        file.close()
        raise
    return RecordingFile(path, file, layout)


def read(path: str | Path, signals: Iterable[str] | None = None) -> Recording:
    """Read a recording.

    Parameters
    ----------
    path : str or Path
        A recording of version 1 or 2. It may still be written by another process.
    signals : iterable of str, optional
        The signals wanted besides `time`; memory is in proportion to them. All when not given.

    Raises
    ------
    BadInput
        The first rule that the file breaks, naming file, item, what was found and what to do.
    """
    with open_recording(path) as file:
        return file.load(signals)


def validate(path: str | Path) -> list[BadInput]:
    """Everything that is wrong with a recording; empty when nothing is. Holds one signal at a time in memory."""
    path = Path(path)
    problems = Problems(keep_going=True)
    with problems.within(str(path)), opened(path) as file:
        layout_of(file, str(path), problems, values=True)
    return problems.found


def opened(path: Path) -> h5py.File:
    """Open a file on whose declarations the HDF5 library is known to survive."""

    def reading() -> None:
        with open_hdf5(path) as file:
            layout_of(file, str(path), Problems(keep_going=True))

    probe(path, reading)
    return open_hdf5(path)


def _values(file: h5py.File, group: str, name: str, path: str) -> Array:
    where = f"{path}: /{group}/{name}"
    with h5py_errors(where):
        if group == "signals" and name == "time":
            return clock_of(member(file[group], name, h5py.Dataset, where), where)
        return numbers_of(member(file[group], name, h5py.Dataset, where))
