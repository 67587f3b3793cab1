"""The plugin for pytest, in tests of tests: what the fixtures do, what a failed test leaves, and the page's example."""

from __future__ import annotations

import os
import re
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

import bristle.door.simulated  # noqa: F401 what the tests inside load is loaded here once, and not again for each
from recordings import read

pytest_plugins = ["pytester"]

HOUSE = Path(__file__).resolve().parents[2]
PAGE = HOUSE / "docs" / "how-to" / "hil-tests.md"


@pytest.fixture
def inner(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch):
    """Runs tests that have the plugin and no other."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)

    def run(*options: str) -> pytest.RunResult:
        return pytester.runpytest_inprocess("-p", "bristle.pytest_plugin", "-p", "no:cacheprovider", *options)

    return run


def test_the_package_tells_pytest_of_it():
    project = tomllib.loads((HOUSE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["entry-points"]["pytest11"] == {"bristle": "bristle.pytest_plugin"}
    assert not any(name.startswith("pytest") for name in project["dependencies"])


def test_it_is_found_where_it_is_installed_and_can_be_left_out(pytester, monkeypatch):
    """With the metadata of an installed package on the path, in a process of its own."""
    info = pytester.mkdir("site") / "bristle-0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: bristle-under-test\nVersion: 0\n")
    (info / "entry_points.txt").write_text("[pytest11]\nbristle = bristle.pytest_plugin\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(info.parent), str(HOUSE)]))
    pytester.makepyfile("def test_it(pytestconfig): assert pytestconfig.pluginmanager.has_plugin('bristle')")
    pytester.runpytest_subprocess().assert_outcomes(passed=1)
    pytester.makepyfile(
        "import sys\n"
        "def test_it(pytestconfig):\n"
        "    assert not pytestconfig.pluginmanager.has_plugin('bristle')\n"
        "    assert 'bristle.pytest_plugin' not in sys.modules\n"
    )
    pytester.runpytest_subprocess("-p", "no:bristle").assert_outcomes(passed=1)


def test_fixtures_are_valves_that_give_the_same_numbers_every_time(pytester, inner):
    pytester.makepyfile(
        """
        import pytest
        seen = []

        @pytest.mark.parametrize("time", [1, 2])
        def test_tcp(valve, time):
            assert valve.endpoint == f"tcp://{valve.host}:{valve.port}"
            assert valve.host == "127.0.0.1"
            valve.advance(3.0)
            with valve.connect() as device:
                seen.append((device.read("position"), valve.now["pressure"]))
            assert len(set(seen)) == 1

        def test_rtu(positioner):
            assert positioner.endpoint.startswith(f"rtu:{positioner.device}?")
            positioner.advance(3.0)
            with positioner.connect() as device:
                assert device.read("position") == pytest.approx(positioner.now["position"], abs=4e-6)

        def test_several(valve_factory):
            one, other = valve_factory(settings={"setpoint": 0.2}), valve_factory(settings={"setpoint": 0.8})
            assert (one.name, other.name) == ("valve", "valve-2")
            one.advance(6.0), other.advance(6.0)
            assert one.now["position"] < other.now["position"]
        """
    )
    inner().assert_outcomes(passed=4)


FAILING = """
    def test_it(valve):
        valve.advance(1.0)
        valve.inject("friction of valve or bushing", 0.5, at=1.5)
        valve.harm("drop", 0.5)
        valve.advance(1.0)
        assert valve.now["position"] > 1.0
"""


def test_a_failed_test_leaves_recording_and_picture_in_its_report(pytester, inner):
    pytester.makepyfile(FAILING)
    pytester.makeini("[pytest]\nbristle_artifacts = left\njunit_family = xunit1\n")
    result = inner("--junitxml=report.xml")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "*Simulated valve*",
            "tcp://127.0.0.1:* plant time 2 s",
            "*1.5000 s  fault: f4 *",
            "recording: *",
            "picture: *",
        ]
    )
    properties = ElementTree.parse(pytester.path / "report.xml").iter("property")
    left = {one.attrib["name"]: Path(one.attrib["value"]) for one in properties}
    assert {path.parent for path in left.values()} == {pytester.path / "left"}
    recording = read(left["bristle_recording"])
    assert len(recording) == 801
    assert [event.kind for event in recording.events] == ["injected", "harm", "fault"]
    assert ElementTree.parse(left["bristle_picture"]).getroot().tag.endswith("svg")


def test_what_cannot_be_recorded_is_said_and_hides_nothing(pytester, inner):
    pytester.makepyfile("def test_it(valve): assert 1 == 2")
    result = inner()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*assert 1 == 2*", "no recording: *"])


def test_a_test_that_passes_leaves_nothing(pytester, inner):
    pytester.makepyfile("def test_it(valve): valve.advance(0.1)")
    inner("--bristle-artifacts=left").assert_outcomes(passed=1)
    assert not (pytester.path / "left").exists()


@pytest.mark.parametrize("by", ["option", "ini"])
def test_a_plant_file_says_what_the_valve_is(pytester, inner, by):
    (pytester.path / "valve.toml").write_text(
        'friction = "lugre"\n[set]\nsetpoint = 0.2\n"lugre.fs" = 321.0\n[[fault]]\nnumber = 13\nfrom = 0.5\n'
    )
    if by == "ini":
        pytester.makeini("[pytest]\nbristle_plant = valve.toml\n")
    pytester.makepyfile(
        """
        def test_it(valve):
            with valve.connect() as device:
                device.write("setpoint", 0.3)
            valve.advance(1.0)
            assert [event.text.split()[0] for event in valve.events()] == ["f13"]
            assert valve.now["fault_active"] == 1.0
        """
    )
    result = inner(*(["--bristle-plant=valve.toml"] if by == "option" else []))
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["bristle: plant *valve.toml"])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("frction = 'lugre'", "*valve.toml: frction: this key is not known; known there: map*"),
        ("[[fault]]\nnumber = 4\nstart = 3", "*valve.toml: fault.0.start: this key is not known; known there: number*"),
        ("[set]\nsetpoint = 'half'", "*valve.toml: set.setpoint: Input should be a valid number*"),
        ("[set]\nset_point = 0.5", "*there is no setting 'set_point'*"),
        ("[set", "*valve.toml: it is not TOML*"),
        (None, "*valve.toml: there is no such file; check the path*"),
    ],
)  # fmt: skip
def test_a_plant_file_that_cannot_be_used_is_said_before_any_test(pytester, inner, content, words):
    if content is not None:
        (pytester.path / "valve.toml").write_text(content)
    pytester.makepyfile("def test_it(valve): pass")
    result = inner("--bristle-plant=valve.toml")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([words])


@pytest.fixture(scope="module")
def page():
    """The example of the page."""
    (found,) = re.findall(r"^```python no-test\n(# test_controller.py\n.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
    return found


@pytest.mark.slow
def test_the_example_of_the_page_passes(pytester, inner, page):
    (pytester.path / "test_controller.py").write_text(page)
    inner().assert_outcomes(passed=3)


@pytest.mark.parametrize(
    ("right", "wrong", "test"),
    [
        (
            "gain=0.002, reset_s=2.0",
            "gain=0.006, reset_s=1.0",
            "test_a_valve_that_sticks",
        ),
        ("pass  #", "self.integral = 0.0  #", "test_a_lost_link"),
    ],
)
def test_the_example_of_the_page_finds_a_controller_that_does_it_wrong(pytester, inner, page, right, wrong, test):
    assert page.count(right) == 1
    (pytester.path / "test_controller.py").write_text(page.replace(right, wrong))
    result = inner("-k", test)
    result.assert_outcomes(failed=1, deselected=2)
    result.stdout.fnmatch_lines([f"FAILED *{test}*"])
