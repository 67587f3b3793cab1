"""Valves and loops as plants know them: the standard valve tests, and loops from set point, output and value."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import cast

from bristle.door.sources import RecordingLike, read, read_all
from bristle.door.valves import valve_of
from identification.loops import Assessment, assess_loop, known_of, read_loop
from identification.standard_tests import TestKind, ValveTest, simulated_test, standard_test
from recordings import BUNDLED, Progress, Recording, silent
from recordings.importers import is_recording
from simulator import ValveModel


def test(
    recordings: RecordingLike | Iterable[RecordingLike],
    kind: str,
    *,
    reference: ValveTest | str | os.PathLike[str] | None = None,  # noqa: PT028 - not a test of pytest
    progress: Progress = silent,  # noqa: PT028
) -> ValveTest:
    """Run a standard valve test on recordings.

    Parameters
    ----------
    recordings : recording, path or ``bundled:NAME``, or several of them
        Of the test: the stem position, and the set point or what else drove the valve.
    kind : {"step", "deadband", "signature", "partial-stroke", "error-band"}
        Which test.
    reference : ValveTest or path, optional
        An earlier test of the same kind; what changed beyond the noise of both is said.
    progress : callable, optional
        Told the stages of the work, once the input can be used.

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
    return standard_test(read_all(recordings), cast("TestKind", kind), reference, progress)


test.__test__ = False  # type: ignore[attr-defined]  # pytest must not take it for one of its tests


def simulate_test(
    kind: str,
    *,
    model: ValveModel | str | os.PathLike[str] | None = None,
    seed: int = 0,
    stroke: float | None = None,
    progress: Progress = silent,
) -> Recording:
    """Run a standard test on a simulated valve behind a positioner: a recording for `test`.

    Parameters
    ----------
    kind : as for `test`
        Which test.
    model : ValveModel or path, optional
        The valve; without one, a LuGre valve of the seed.
    seed : int, optional
        Of the random valve, and of the noise.
    stroke : float, optional
        Stroke [m]; that of the valve otherwise.
    progress : callable, optional
        Told the stages of the work, once the input can be used.

    Returns
    -------
    Recording
        Signals ``time`` [s], ``setpoint`` [% of span], ``force`` [N] and ``position`` [m].

    Raises
    ------
    BadInput
        There is no such test, or the model cannot be read.

    >>> import bristle as br
    >>> recording = br.simulate_test("partial-stroke", seed=1)
    >>> br.test(recording, "partial-stroke").aborted
    ()
    """
    effects, values, length = valve_of(model, seed)
    return simulated_test(
        cast("TestKind", kind), values, stroke or length, effects=effects, seed=seed, progress=progress
    )


def assess(
    source: RecordingLike,
    *,
    loop: str | None = None,
    columns: Mapping[str, str] | None = None,
    valve: Mapping[str, float] | None = None,
    progress: Progress = silent,
) -> Assessment:
    """Say whether the valve of a control loop sticks, from set point, process value and controller output.

    Parameters
    ----------
    source : recording or path
        A recording, or historian data in a file that `bristle import` reads. The time is in seconds or a date.
    loop : {"flow", "pressure", "level", "temperature"}, optional
        The kind of loop; a tag such as FIC-211 says it too. Methods that are not made for it do not answer.
    columns : mapping, optional
        Columns or signals by SP, PV, OP and TIME, each perhaps with ``:UNIT``: ``{"PV": "FT211", "OP": "FV211:%"}``.
    valve : mapping, optional
        Data of a spring-opposed valve without a positioner, for friction in N: ``{"stroke": 0.02, "K": 5e4}`` [m],
        [N/m], or ``{"area": 0.0129, "span": 80}`` [m2], [kPa]. Those of a recording's plant otherwise.
    progress : callable, optional
        Told the stages of the work, once the input can be used.

    Returns
    -------
    Assessment
        ``verdict`` (``stiction``, ``no_stiction``, ``cannot_tell``), ``probability``, ``amount`` (S and J), ``forces``,
        the problems of the data, and every method's answer. `write`, `report`.

    Raises
    ------
    BadInput
        A column is missing, OP is constant, PV is a copy of SP, the clock runs backwards, or the sampling is mixed.

    >>> import bristle as br
    >>> from identification.loops import simulated_loop
    >>> known = simulated_loop(6001, "stiction", "flow", "kano").loop
    >>> t = [known.dt * k for k in range(len(known.pv))]
    >>> extra = {"SP": known.sp, "PV": known.pv, "OP": known.op}
    >>> recording = br.Recording.from_arrays(time=t, extra=extra, units=dict.fromkeys(extra, "%"))
    >>> br.assess(recording, loop="flow").verdict
    'stiction'
    """
    opened = _recording_or_file(source)
    known = known_of(opened.plant) if isinstance(opened, Recording) and valve is None else valve
    found = read_loop(opened, loop, columns)
    progress("asking every method", 0, 0)
    return assess_loop(*found, known)


def _recording_or_file(source: RecordingLike) -> Recording | Path:
    """A recording where it is one, else the file to import."""
    if isinstance(source, Recording):
        return source
    name = os.fspath(source)
    return read(name) if name.startswith(BUNDLED) or is_recording(Path(name)) else Path(name)
