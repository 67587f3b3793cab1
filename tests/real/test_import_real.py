"""The ready mappings on the measured files they were made for, against what is known of those files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.measured_data import DATA
from recordings import Recording, read, validate, write
from recordings.importers import import_to

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the measured data is not here ({DATA})")


def files(pattern: str) -> Iterable[object]:
    """The files of a pattern as parameters; one that skips when there is none."""
    found = sorted(DATA.glob(pattern)) if DATA.is_dir() else []
    return [pytest.param(file, id=file.name) for file in found] or [pytest.param(Path("none"), id="no data")]


def imported(folder: Path, name: str, mapping: str, **changes: object) -> Recording:
    """A measured file as a recording, by way of a file."""
    if not (DATA / name).is_file():
        pytest.skip(f"{name} is not in {DATA}")
    target = folder / "made.h5"
    import_to(DATA / name, target, mapping, changes)
    assert validate(target) == []
    return read(target)


def roles(made: Recording) -> dict[str, str]:
    return {name: made[name].role for name in ("position", "force") if name in made}


def test_emps(tmp_path: Path) -> None:
    made = imported(tmp_path, "emps/DATA_EMPS.mat", "emps")
    assert (len(made), made.source, roles(made)) == (24841, "rig", {"position": "output", "force": "input"})
    assert made.time[-1] == pytest.approx(24.84, abs=0.001)
    assert np.nanmax(made["position"].values) == pytest.approx(0.2464, abs=1e-4)
    gain = made.attributes["gtau"]
    np.testing.assert_allclose(made["force"].values, float(gain) * made["controller_output"].values)
    q, kp, kv = made["position"].values, float(made.attributes["kp"]), float(made.attributes["kv"])
    law = kp * kv * (made["reference_position"].values - q)[2:] - kv * (q[2:] - q[:-2]) / 0.002
    assert np.std(made["controller_output"].values[2:] - law) < 5e-3  # the controller of the rig, in volts
    assert str(made.attributes["imported_sha256"]).startswith("6cf6814a")


@pytest.mark.parametrize("file", files("pneumatic_cylinder_seals/friction/*.csv.gz"))
def test_pneumatic_cylinder(tmp_path: Path, file: Path) -> None:
    mapping = "pneumatic-cylinder-257" if "257" in file.name else "pneumatic-cylinder"
    made = imported(tmp_path, str(file.relative_to(DATA)) if file.is_absolute() else str(file), mapping)
    assert roles(made) == {"position": "input", "force": "output"}
    assert 55 < made.time[-1] < 110
    position, force, bar = made["position"].values, made["force"].values, made["pressure"].values / 1e5
    assert 0.03 < position.max() - position.min() < 0.05
    assert float(file.name.split("bar")[0].split("_")[-1]) == pytest.approx(bar.mean(), abs=0.2)
    area = made.plant.diaphragm_area_m2
    assert area == pytest.approx(np.pi / 4 * (0.0257 if "257" in file.name else 0.025) ** 2, rel=1e-9)
    np.testing.assert_allclose(force, made["load_cell"].values - bar * 1e5 * area, atol=1e-9)
    speed = np.gradient(position, made.time)
    out, back = force[speed > 0.002], force[speed < -0.002]
    assert 1.5 < (np.median(out) - np.median(back)) / 2 < 25  # half the width of the loop: friction, with its sign


def test_another_area_of_the_cylinder(tmp_path: Path) -> None:
    name = "pneumatic_cylinder_seals/friction/O-ring_5bar.csv.gz"
    made = imported(tmp_path, name, "pneumatic-cylinder", plant={"diaphragm_area_m2": 5e-4})
    expected = made["load_cell"].values - made["pressure"].values * 5e-4
    np.testing.assert_allclose(made["force"].values, expected, atol=1e-9)


def test_tribometer(tmp_path: Path) -> None:
    made = imported(tmp_path, "tribometer_presliding/test_data_2.txt.gz", "tribometer")
    assert roles(made) == {"position": "input", "force": "output"}
    assert 10 <= made.time[0] < made.time[-1] <= 209
    assert np.ptp(made["position"].values) == pytest.approx(2 * 0.115e-3, rel=0.05)
    np.testing.assert_allclose(made["normal_force"].values, 5.0, atol=0.01)
    assert np.abs(made["force"].values).max() / 5.0 == pytest.approx(0.5, abs=0.05)
    power = np.sum(made["force"].values[1:] * np.diff(made["position"].values))
    assert power > 0  # friction takes energy out of the drive


def test_damadics_plant_hour(tmp_path: Path) -> None:
    made = imported(tmp_path, "damadics/OneHourTestData_ExampleII.mat", "damadics-plant-hour")
    assert (len(made), made.source, made.plant.tag) == (3600, "plant", "LC74_20")
    stem = made["position"].values / 0.0381
    drive = made.si("drive").values
    lag = [np.std(stem[k : 3500 + k] - drive[:3500]) for k in range(5)]
    assert int(np.argmin(lag)) == 1  # the stem follows the drive by one second
    assert lag[1] == pytest.approx(0.035, abs=0.003)
    assert np.corrcoef(stem, made["feed_water_flow"].values)[0, 1] == pytest.approx(-0.91, abs=0.02)  # X counts closing
    assert 3.4e6 < made["upstream_pressure"].values.mean() < 3.7e6


@pytest.mark.parametrize("file", files("kinova_joint7_friction/velocity_*.csv.gz"))
def test_kinova(tmp_path: Path, file: Path) -> None:
    made = imported(tmp_path, str(file.relative_to(DATA)) if file.is_absolute() else str(file), "kinova-joint7")
    assert roles(made) == {"position": "input", "force": "output"}
    speed = float(file.name.removeprefix("velocity_").split("readings")[0])
    reached = np.polyfit(made.time[1000:], made["position"].values[1000:], 1)[0]
    assert reached == pytest.approx(speed, abs=0.03)
    assert np.abs(np.diff(made["position"].values)).max() < 0.01  # unwrapped
    current = made["force"].values.mean() / 7.6
    assert 0.18 < current < 0.34


def test_valve_signature(tmp_path: Path) -> None:
    made = imported(tmp_path, "damadics/fig5_valve_signature.csv", "valve-signature", time={"rate_hz": 4.0})
    assert (len(made), made.time[1]) == (43, 0.25)
    assert (made["position"].unit, made["pressure"].unit) == ("m", "Pa")
    pressure, stem = made["pressure"].values, made["position"].values / 0.0381
    top = int(np.argmax(pressure))
    assert np.all(np.diff(pressure[: top + 1]) >= 0)
    assert np.all(np.diff(pressure[top:]) <= 0)
    at_half = [np.interp(0.5, stem[: top + 1], pressure[: top + 1]), np.interp(0.5, stem[:top:-1], pressure[:top:-1])]
    assert at_half == pytest.approx([63.0e3, 55.7e3], rel=0.02)
    steep = (stem > 0.1) & (stem < 0.9)
    slope = np.polyfit(stem[: top + 1][steep[: top + 1]], pressure[: top + 1][steep[: top + 1]], 1)[0]
    assert slope == pytest.approx(75.1e3, rel=0.02)


def test_a_step_of_the_servomotor_by_options_alone(tmp_path: Path) -> None:
    changes = {"time": {"column": 1, "unit": "ms"}, "signals": {"position": {"column": 2, "unit": "mm"}}}
    source = DATA / "damadics/fig6_step_up.csv"
    import_to(source, tmp_path / "step.h5", None, changes)
    made = read(tmp_path / "step.h5")
    np.testing.assert_allclose(made.time, 1e-3 * np.loadtxt(source, delimiter=",", skiprows=1)[:, 0])
    write(tmp_path / "again.h5", made)
    assert validate(tmp_path / "again.h5") == []
