"""The plugin for pytest: simulated valves as fixtures, and what they did in the report of a test that failed.

pytest finds it by itself where Bristle is installed; ``-p no:bristle`` leaves it out. Nothing else imports this module,
and the simulator is loaded when a fixture is first used.
"""

from __future__ import annotations

import re
from collections.abc import Generator, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pytest

if TYPE_CHECKING:
    from hil.testing import SimulatedValve

LONGEST_NAME = 120
"""Letters of a test's name in the names of its files."""


class ValveFactory(Protocol):
    """Makes simulated valves that end with the test. The parameters are those of `bristle.simulated_valve`."""

    def __call__(self, **options: Any) -> SimulatedValve:
        """A served valve. Raises BadInput for what it cannot be."""


_VALVES = pytest.StashKey["list[SimulatedValve]"]()
_FOLDER = pytest.StashKey[Path]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options, and the same as keys of the ini file."""
    group = parser.getgroup("bristle", "simulated valves")
    group.addoption("--bristle-plant", metavar="FILE", help="Plant file (TOML) of the simulated valves.")
    group.addoption("--bristle-artifacts", metavar="DIR", help="Where recordings of failed tests go.")
    parser.addini("bristle_plant", "Plant file (TOML) of the simulated valves, relative to the ini file.")
    parser.addini("bristle_artifacts", "Where recordings of failed tests go, relative to the ini file.")


def pytest_configure(config: pytest.Config) -> None:
    """Refuse a plant file that cannot be used before any test runs."""
    plant = _path(config, "plant")
    if plant is None:
        return
    from bristle.door.plant_file import SimulatedPlantFile
    from recordings import BadInput

    try:
        SimulatedPlantFile.load(plant).plant()
    except BadInput as error:
        raise pytest.UsageError(f"bristle: {error}") from None


def pytest_report_header(config: pytest.Config) -> list[str]:
    """Which plant the tests have."""
    plant = _path(config, "plant")
    return [] if plant is None else [f"bristle: plant {plant}"]


@pytest.fixture
def valve_factory(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ValveFactory]:
    """Makes simulated valves: valve_factory(friction="lugre", noise=True, seed=3, listen="pty:", speed=None ...)."""
    from bristle.door.simulated import simulated_valve

    made = request.node.stash.setdefault(_VALVES, [])
    request.node.stash[_FOLDER] = _path(request.config, "artifacts") or tmp_path_factory.getbasetemp() / "bristle"
    plant = _path(request.config, "plant")
    with ExitStack() as stack:

        def make(**options: Any) -> SimulatedValve:
            usual = {"plant": plant, "name": f"valve-{len(made) + 1}" if made else "valve"}
            valve = stack.enter_context(simulated_valve(**{**usual, **options}))
            made.append(valve)
            return valve

        yield make


@pytest.fixture
def valve(valve_factory: ValveFactory) -> SimulatedValve:
    """A simulated valve with positioner on Modbus TCP: a free loopback port, lock-step, the same numbers every time."""
    return valve_factory()


@pytest.fixture
def positioner(valve_factory: ValveFactory) -> SimulatedValve:
    """A simulated valve on Modbus RTU: a pseudo terminal, 16-bit registers, lock-step, the same numbers every time."""
    return valve_factory(listen="pty:", map="positioner-int16", name="positioner")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Attach recording and picture of every valve to the report of a test that failed."""
    report = yield
    if report.failed and report.when != "teardown":  # the valves are gone by then
        for valve in item.stash.get(_VALVES, []):
            _attach(item, report, valve)
    return report


def _attach(item: pytest.Item, report: pytest.TestReport, valve: SimulatedValve) -> None:
    """A section with the events and the paths, and the paths as properties for JUnit XML."""
    lines = [f"{valve.endpoint}, plant time {valve.now['plant_time']:g} s"]
    lines += [f"{event.time:10.4f} s  {event.kind}: {event.text}" for event in valve.events()]
    try:
        paths = valve.save(item.stash[_FOLDER], f"{_stem(item.nodeid)}-{valve.name}")
    except (OSError, ValueError) as error:  # BadInput is one: time has not moved, or the disk is full
        lines.append(f"no recording: {error}")
    else:
        for kind, path in zip(("recording", "picture"), paths, strict=True):
            lines.append(f"{kind}: {path}")
            entry = (f"bristle_{kind}", str(path))
            item.user_properties.append(entry)
            report.user_properties.append(entry)
    report.sections.append((f"Simulated {valve.name}", "\n".join(lines)))


def _path(config: pytest.Config, name: str) -> Path | None:
    """The path of an option, or of the ini key of the same name."""
    option = config.getoption(f"bristle_{name}")
    if option:
        return config.invocation_params.dir / option
    key = config.getini(f"bristle_{name}")
    return (config.inipath.parent if config.inipath else config.rootpath) / key if key else None


def _stem(nodeid: str) -> str:
    return re.sub(r"[^\w.-]+", "_", nodeid)[-LONGEST_NAME:].strip("_.")
