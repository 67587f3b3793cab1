"""Valves and loops as plants test them: the standard valve tests."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import cast

from bristle.door.sources import RecordingLike, read_all
from identification.standard_tests import TestKind, ValveTest, standard_test


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
