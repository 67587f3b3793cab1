"""What a plant file says of a simulated valve, and options on top of it."""

from __future__ import annotations

from bristle.cli.plant_options import ActuatorOptions
from bristle.door.plant_file import SimulatedPlantFile

CONTENT = """
friction = "lugre"
seed = 4
noise = true
[set]
setpoint = 0.2
"lugre.fs" = 250.0
[[fault]]
number = 13
from = 1.0
until = 2.0
"""


def loaded(tmp_path) -> SimulatedPlantFile:
    path = tmp_path / "valve.toml"
    path.write_text(CONTENT)
    return SimulatedPlantFile.load(path)


def test_a_file_says_what_the_valve_is(tmp_path):
    setup = ActuatorOptions(base=loaded(tmp_path)).plant(1).setup
    assert (setup.form, setup.noise, setup.seed) == ("lugre", True, 5)
    assert (setup.inputs, setup.friction) == ({"setpoint": 0.2}, {"fs": 250.0})
    assert [(one.number, one.start_s, one.stop_s) for one in setup.faults] == [(13, 1.0, 2.0)]


def test_options_come_on_top_of_it(tmp_path):
    options = ActuatorOptions(
        settings=("setpoint=0.7",), faults=("4:strength=0.5",), seed=9, effects=("backlash",), base=loaded(tmp_path)
    )
    setup = options.plant().setup
    assert (setup.seed, setup.inputs, setup.friction) == (9, {"setpoint": 0.7}, {"fs": 250.0})
    assert [one.number for one in setup.faults] == [13, 4]
    assert list(setup.hidden) == ["backlash"]


def test_an_empty_file_is_the_usual_valve(tmp_path):
    (tmp_path / "valve.toml").write_text("")
    assert SimulatedPlantFile.load(tmp_path / "valve.toml") == SimulatedPlantFile()
    setup = SimulatedPlantFile().plant().setup
    assert (setup.form, setup.noise, setup.faults) == ("play", False, ())
