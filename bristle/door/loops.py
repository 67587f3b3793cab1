"""Valves and loops as plants know them: the standard valve tests, and loops from set point, output and value."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import cast

from bristle.door.sources import BUNDLED, RecordingLike, read, read_all
from identification.loops import Assessment, assess_loop, read_loop
from identification.standard_tests import TestKind, ValveTest, standard_test
from recordings import Recording
from recordings.importers import is_recording


def test(
    recordings: RecordingLike | Iterable[RecordingLike],
    kind: str,
    *,
    reference: ValveTest | str | os.PathLike[str] | None = None,  # noqa: PT028 - not a test of pytest
) -> ValveTest:
    """Run a standard valve test on recordings.

    Parameters
    ----------
    recordings : recording, path or ``bundled:NAME``, or several of them
        Of the test: the stem position, and the set point or what else drove the valve.
    kind : {"step", "deadband", "signature", "partial-stroke"}
        Which test.
    reference : ValveTest or path, optional
        An earlier test of the same kind; what changed beyond the noise of both is said.

    Returns
    -------
    ValveTest
        ``values`` with their intervals, ``changed``, ``problems``. `write`, `report`.

    Raises
    ------
    BadInput
        The recordings do not hold such a test: no step, no stroke both ways, no set point, an unknown stroke.

    >>> import bristle as br
    >>> found = br.test("bundled:step", "step")
    >>> sorted(found.values["steps"][0])[:3]
    ['T63_s', 'T86_s', 'Td_s']
    """
    return standard_test(read_all(recordings), cast("TestKind", kind), reference)


test.__test__ = False  # type: ignore[attr-defined]  # pytest must not take it for one of its tests


def assess(source: RecordingLike, *, loop: str | None = None, columns: Mapping[str, str] | None = None) -> Assessment:
    """Say whether the valve of a control loop sticks, from set point, process value and controller output.

    Parameters
    ----------
    source : recording or path
        A recording, or historian data in a file that `bristle import` reads. The time is in seconds or a date.
    loop : {"flow", "pressure", "level", "temperature"}, optional
        The kind of loop; a tag such as FIC-211 says it too. Methods that are not made for it do not answer.
    columns : mapping, optional
        Columns or signals by SP, PV, OP and TIME, each perhaps with ``:UNIT``: ``{"PV": "FT211", "OP": "FV211:%"}``.

    Returns
    -------
    Assessment
        ``verdict`` (``stiction``, ``no_stiction``, ``cannot_tell``), ``probability``, ``amount`` (S and J), the
        problems of the data, and every method's answer. `write`, `report`.

    Raises
    ------
    BadInput
        A column is missing, OP is constant, PV is a copy of SP, the clock runs backwards, or the sampling is mixed.

    >>> import bristle as br
    >>> from identification.loops import simulated_loop
    >>> known = simulated_loop(1, "stiction", "flow").loop
    >>> t = [known.dt * k for k in range(len(known.pv))]
    >>> extra = {"SP": known.sp, "PV": known.pv, "OP": known.op}
    >>> recording = br.Recording.from_arrays(time=t, extra=extra, units=dict.fromkeys(extra, "%"))
    >>> br.assess(recording, loop="flow").verdict
    'stiction'
    """
    return assess_loop(*read_loop(_recording_or_file(source), loop, columns))


def _recording_or_file(source: RecordingLike) -> Recording | Path:
    """A recording where it is one, else the file to import."""
    if isinstance(source, Recording):
        return source
    name = os.fspath(source)
    return read(name) if name.startswith(BUNDLED) or is_recording(Path(name)) else Path(name)
