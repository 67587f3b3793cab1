"""`bristle fit` on measurements, against what their authors published or what the recorded loop itself shows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.measured_data import DATA
from bristle.cli.app import run
from identification import experiment, identify
from identification.sparse_regression.regression import Regression, regression
from identification.sparse_regression.sliding import sliding as sliding_windows
from recordings import Plant, Recording, Signal, read
from recordings.importers import import_to
from simulator import ValveModel

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the measured data is not here ({DATA})")

EMPS_MASS = 95.1089
EMPS_COULOMB, EMPS_VISCOUS = (20.144, 20.628), (166.706, 240.424)
"""Published for the EMPS benchmark (Janot, Gautier, Brunot 2019): kg, and the asymmetric ranges in N and N s/m."""

AREA, STROKE = 0.0290, 0.0381
"""Diaphragm area [m2] and stroke [m] of the servomotor of the valve signature."""


def emps(folder: Path) -> Path:
    target = folder / "emps.h5"
    import_to(DATA / "emps/DATA_EMPS.mat", target, "emps", {})
    return target


@pytest.mark.slow
def test_emps_has_the_published_mass_and_friction(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The published model has no Stribeck effect, so the Stribeck velocity is held where it plays no part."""
    model = tmp_path / "model.json"
    code = run(
        ["fit", str(emps(tmp_path)), "--hold", "--without", "spring", "--given", "lugre.vs=1e-4", "--out", str(model)]
    )
    found = ValveModel.read(model)
    assert code == 0, capsys.readouterr().err
    assert found.values["mass.m"] == pytest.approx(EMPS_MASS, rel=0.02)
    assert EMPS_COULOMB[0] < found.values["lugre.fc"] < EMPS_COULOMB[1]
    assert EMPS_VISCOUS[0] < found.values["lugre.sigma2"] < EMPS_VISCOUS[1]


def test_emps_with_the_full_friction_law(tmp_path: Path) -> None:
    """Friction of this drive falls towards zero speed; the mass stays, and viscous friction keeps its range."""
    found = identify([read(emps(tmp_path))], hold=True, given={"spring.K": 0.0})
    values, std = found.model.values, found.uncertainty.std
    assert values["mass.m"] == pytest.approx(EMPS_MASS, rel=0.02)
    assert values["lugre.fs"] < values["lugre.fc"]
    assert EMPS_VISCOUS[0] - std["lugre.sigma2"] < values["lugre.sigma2"] < EMPS_VISCOUS[1] + std["lugre.sigma2"]
    assert found.crosscheck is not None
    assert found.crosscheck.agrees


def test_emps_shows_its_asymmetric_friction_without_a_model(tmp_path: Path) -> None:
    """Published: viscous friction of its own in either direction. Nothing is fitted, and no law is assumed."""
    found = regression(sliding_windows([experiment(read(emps(tmp_path)), hold=True)]))
    assert isinstance(found, Regression)
    values = {q.name: q for q in found.quantities}
    assert abs(values["spring.K"].value) < 10.0
    slopes = []
    for way in ("rising", "falling"):
        level = {float(n.split(", ")[1].split()[0]): q.value for n, q in values.items() if way in n}
        slow, fast = sorted(level)
        slopes.append(1e3 * (level[fast] - level[slow]) / (fast - slow))
    assert sorted(slopes) == pytest.approx(EMPS_VISCOUS, rel=0.1)


def sliding(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Which samples go out and come back at mid-stroke."""
    x = recording["position"].values
    velocity = np.gradient(x, recording.time)
    low, high = np.nanquantile(x, [0.35, 0.65])
    middle = (x > low) & (x < high)
    return middle & (velocity > 1e-3), middle & (velocity < -1e-3)


def half_width(recording: Recording) -> float:
    """Half the distance between the forces of the two directions at mid-stroke [N]."""
    force = recording["force"].values
    out, back = sliding(recording)
    return float(abs(np.median(force[out]) - np.median(force[back])) / 2)


def sliding_friction(model: ValveModel, recording: Recording) -> float:
    """Fitted friction at the speeds of the two directions, their mean [N]."""
    p, velocity = model.values, np.gradient(recording["position"].values, recording.time)
    speeds = np.array([abs(np.median(velocity[way])) for way in sliding(recording)])
    level = p["lugre.fc"] + (p["lugre.fs"] - p["lugre.fc"]) * np.exp(-((speeds / p["lugre.vs"]) ** 2))
    return float(np.mean(level + p["lugre.sigma2"] * speeds))


def cylinder(folder: Path, seal: str, pressure: int) -> Recording:
    """A file of the cylinder, imported; its own piston for the seals with 257 in their name."""
    file = DATA / f"pneumatic_cylinder_seals/friction/{seal}_{pressure}bar.csv.gz"
    if not file.is_file():
        pytest.skip(f"{file.name} is not in {DATA}")
    target = folder / f"{seal}-{pressure}.h5"
    import_to(file, target, "pneumatic-cylinder-257" if "257" in seal else "pneumatic-cylinder", {})
    return read(target)


PRESSURES = (1, 3, 5, 7)
SEALS = ("O-ring", "O-ring257", "NAPN", "PK")
SEALS_TESTED = [SEALS[0], *(pytest.param(seal, marks=pytest.mark.slow) for seal in SEALS[1:])]


@pytest.mark.slow
@pytest.mark.parametrize("seal", SEALS_TESTED)
def test_cylinder_friction_is_the_half_width_and_rises_with_pressure(tmp_path: Path, seal: str) -> None:
    fitted = []
    for pressure in PRESSURES:
        recording = cylinder(tmp_path, seal, pressure)
        found = identify([recording], given={"spring.K": 0.0}, check=False)
        assert found.fit.kernel.causality == "motion"
        fitted.append(sliding_friction(found.model, recording))
        assert fitted[-1] == pytest.approx(half_width(recording), abs=1.0), f"{seal} at {pressure} bar"
    assert fitted == sorted(fitted), f"{seal}: {fitted}"


@pytest.mark.slow
@pytest.mark.parametrize("seal", SEALS_TESTED)
def test_coulomb_friction_alone_is_the_half_width_too(tmp_path: Path, seal: str) -> None:
    """Without Stribeck effect and viscous friction the level is one parameter, as in a textbook."""
    dry = {"spring.K": 0.0, "lugre.vs": 1e-7, "lugre.fs": 1.0, "lugre.sigma2": 0.0}
    fitted = []
    for pressure in PRESSURES:
        recording = cylinder(tmp_path, seal, pressure)
        fitted.append(identify([recording], given=dry, check=False).fit.values["lugre.fc"])
        assert fitted[-1] == pytest.approx(half_width(recording), abs=1.0), f"{seal} at {pressure} bar"
    assert fitted == sorted(fitted), f"{seal}: {fitted}"


@pytest.mark.slow
def test_spring_rate_of_the_valve_signature() -> None:
    """The loop without the rows at the stops, where the pressure goes on and the stem does not."""
    table = np.genfromtxt(DATA / "damadics/fig5_valve_signature.csv", delimiter=",", skip_header=1, usecols=(0, 1))
    rows = np.genfromtxt(DATA / "damadics/fig5_valve_signature.csv", delimiter=",", skip_header=1, dtype=str)[:, 2]
    up, down = table[rows == "loading"], table[rows == "unloading"]
    down = down[np.argsort(-down[:, 0])]
    loop = np.vstack([up, down])
    loop = loop[(loop[:, 1] > 5) & (loop[:, 1] < 95)]
    slope = np.mean(
        [
            np.polyfit(b[:, 1], b[:, 0], 1)[0]
            for b in (part[(part[:, 1] > 10) & (part[:, 1] < 90)] for part in (up, down))
        ]
    )
    signals = [
        Signal("time", np.arange(len(loop), dtype=float), "s", "time"),
        Signal("pressure", loop[:, 0], "kPa", "output"),
        Signal("position", loop[:, 1], "%", "input"),
    ]
    recording = Recording.of(signals, plant=Plant(stroke_m=STROKE, diaphragm_area_m2=AREA, moving_mass_kg=2.0))
    found = identify([replace(recording, title="valve signature")], check=False)
    assert found.model.values["spring.K"] == pytest.approx(1e3 * slope * AREA / (STROKE / 100), rel=0.03)


def test_the_imported_valve_signature_has_the_slope_of_its_author(tmp_path: Path) -> None:
    """Through `bristle import`, one point a second. On the stops the stem tells nothing of the spring: not a number.

    Published (fit between 10 and 90 %): 0.751 kPa/%, and 7.3 kPa between the branches.
    """
    target = tmp_path / "signature.h5"
    import_to(DATA / "damadics/fig5_valve_signature.csv", target, "valve-signature", {})
    recording = read(target)
    share = recording.si("position").values / STROKE
    stopped = (share < 0.002) | (share > 1.054)
    pressure = replace(recording["pressure"], values=np.where(stopped, np.nan, recording["pressure"].values))
    signals = (recording.signals | {"pressure": pressure}).values()
    free = Recording.of(signals, plant=replace(recording.plant, diaphragm_area_m2=AREA))
    dry = {"mass.m": 2.0, "lugre.vs": 1e-7, "lugre.fs": 100.0, "lugre.sigma1": 0.0, "lugre.sigma2": 0.0}
    found = identify([free], given=dry, causality="motion", check=False)
    assert found.fit.values["spring.K"] == pytest.approx(751.0 * AREA / (STROKE / 100), rel=0.03)
    assert found.fit.values["lugre.fc"] == pytest.approx(7300.0 / 2 * AREA, rel=0.1)
