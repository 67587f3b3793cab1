"""Bristle: learns what a control valve really does from measured data, and then watches it.

Arrays in, arrays out; a path or ``bundled:NAME`` stands for a recording wherever one is taken.

>>> import bristle as br
>>> step, mixed = br.read("bundled:step"), br.read("bundled:mixed")
>>> found = br.fit(step, holdout=mixed, crosscheck=False)
>>> round(found.values["spring.K"], -2)  # the rate of the spring [N/m]
60900.0

======================= ================================================================================
`read`, `Recording`     a recording from a file, from arrays, or from a data frame
`simulate`              a recording of a simulated valve
`fit`                   friction and spring of a valve, from recordings
`compare_friction`      models of friction by the force that they predict for a recorded motion
`compare_free_runs`     models of friction by the motion that a recorded force leads to
`trace`                 the effect that a valve shows and the model of friction and spring lacks
`compare`               what changed between two recordings or two models of a valve
`assess`                whether the valve of a control loop sticks, from SP, PV and OP
`test`, `simulate_test` a standard valve test, from recordings or a simulated positioner
`export`                a model as C source, CasADi function or FMU; a recording as a table
`follow`                a valve through the years: trends, and when they cross limits
`next_test`             the experiment that would tell rivals apart, or pin what is weak
`learn`, `watch`        a fault detector for one valve, and what it sees in a recording
`record`, `serve`       live recording, and a simulated valve behind Modbus: both are context managers
`simulated_valve`       a simulated valve whose time, faults and line are in the hands of a test
`Fault`                 a fault of the DAMADICS benchmark, for `serve`
`CATALOGUE`, `Effect`   the effects that can be simulated, fitted and traced, and how to write one
======================= ================================================================================

The command line, ``bristle``, has the same functions as commands. Every error that is raised on purpose is a
`BristleError`; catch the level that you can handle::

    BristleError                 everything below
    ├── BadInput                 something given cannot be used: a file, an item in it, an address
    │   └── BadParameter         the same of a parameter of a call: its name and its value
    ├── NegativeAnswer           the work was done and the answer is negative: a fit without values, for example
    └── LinkError                the way to a device failed or went away
        └── ProtocolError        the device answers, but not as its protocol has it

>>> try:
...     br.fit("nowhere.h5")
... except br.BadInput as error:
...     print(error)
nowhere.h5: there is no such file; check the path

Names are loaded when they are first used: importing this module is quick and changes nothing in the process.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bristle.door.comparisons import compare as compare
    from bristle.door.detectors import learn as learn
    from bristle.door.detectors import watch as watch
    from bristle.door.exports import export as export
    from bristle.door.friction import compare_free_runs as compare_free_runs
    from bristle.door.friction import compare_friction as compare_friction
    from bristle.door.histories import follow as follow
    from bristle.door.links import record as record
    from bristle.door.links import serve as serve
    from bristle.door.loops import assess as assess
    from bristle.door.loops import simulate_test as simulate_test
    from bristle.door.loops import test as test
    from bristle.door.models import fit as fit
    from bristle.door.models import trace as trace
    from bristle.door.next_tests import next_test as next_test
    from bristle.door.simulated import simulated_valve as simulated_valve
    from bristle.door.sources import read as read
    from bristle.door.valves import simulate as simulate
    from detector import Watch as Watch
    from detector import Watched as Watched
    from identification import Identification as Identification
    from identification import Trace as Trace
    from recordings import BadInput as BadInput
    from recordings import BadParameter as BadParameter
    from recordings import BristleError as BristleError
    from recordings import LinkError as LinkError
    from recordings import NegativeAnswer as NegativeAnswer
    from recordings import Plant as Plant
    from recordings import ProtocolError as ProtocolError
    from recordings import Recording as Recording
    from recordings import write as write
    from simulator import CATALOGUE as CATALOGUE
    from simulator import Catalogue as Catalogue
    from simulator import Effect as Effect
    from simulator import Parameter as Parameter
    from simulator import Site as Site
    from simulator import ValveModel as ValveModel
    from simulator.damadics import Fault as Fault

    __version__: str

PLACES = {
    "bristle.door.comparisons": ("compare",),
    "bristle.door.detectors": ("learn", "watch"),
    "bristle.door.exports": ("export",),
    "bristle.door.histories": ("follow",),
    "bristle.door.friction": ("compare_free_runs", "compare_friction"),
    "bristle.door.links": ("record", "serve"),
    "bristle.door.loops": ("assess", "simulate_test", "test"),
    "bristle.door.models": ("fit", "trace"),
    "bristle.door.simulated": ("simulated_valve",),
    "bristle.door.next_tests": ("next_test",),
    "bristle.door.valves": ("simulate",),
    "bristle.door.sources": ("read",),
    "detector": ("Watch", "Watched"),
    "identification": ("Identification", "Trace"),
    "recordings": (
        "BadInput", "BadParameter", "BristleError", "LinkError", "NegativeAnswer", "Plant", "ProtocolError",
        "Recording", "write",
    ),
    "simulator": ("CATALOGUE", "Catalogue", "Effect", "Parameter", "Site", "ValveModel"),
    "simulator.damadics": ("Fault",),
}  # fmt: skip
"""Module -> the names that this one offers from it."""

PLACE = {name: module for module, names in PLACES.items() for name in names}

__all__ = sorted([*PLACE, "__version__"])


def __getattr__(name: str) -> Any:
    """A name of the door, loaded at its first use."""
    if name == "__version__":
        value: Any = _version()
    elif name in PLACE:
        value = getattr(importlib.import_module(PLACE[name]), name)
    else:
        raise AttributeError(f"module 'bristle' has no attribute {name!r}; there are {', '.join(__all__)}")
    globals()[name] = value
    return value


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("bristle")
    except PackageNotFoundError:  # run from its sources, without having been installed
        return "unknown"


def __dir__() -> list[str]:
    return list(__all__)
