"""Real identifications of simulated recordings, shared by the tests of this room."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from report_samples import HOSTILE_TAG, HOSTILE_TITLE, recorded

from identification import Identification, identify
from identification.report import write_report
from recordings import Plant, Recording, Signal
from simulator import kernel, random_valve


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Identification], Path]:
    """Writes the report of a fit and gives its path; of the same fit only once."""
    folder, known = tmp_path_factory.mktemp("reports"), list[tuple[Identification, Path]]()

    def write(identification: Identification) -> Path:
        for one, path in known:
            if one is identification:
                return path
        path = folder / f"{len(known)}.html"
        write_report(path, identification)
        known.append((identification, path))
        return path

    return write


@pytest.fixture(scope="session")
def valve_fit() -> Identification:
    """A force-driven fit of two recordings, one with missing samples, one with a gap, judged on a third."""
    first, second, third = recorded("sine:6,step:2"), recorded("step:4", seed=2), recorded("sine:3,step:2", seed=3)
    position = first["position"].values.copy()
    position[500:540] = np.nan
    signals = [replace(first[n], values=position) if n == "position" else first[n] for n in first]
    plant = Plant(stroke_m=first.plant.stroke_m, diaphragm_area_m2=0.03, tag=HOSTILE_TAG)
    kept = np.ones(len(second), bool)
    kept[300:500] = False
    gappy = [replace(second[n], values=second[n].values[kept]) for n in second]
    fitted = [Recording.of(signals, plant=plant, title=HOSTILE_TITLE), Recording.of(gappy, title="gappy")]
    return identify(fitted, holdout=[replace(third, title="judge")])


@pytest.fixture(scope="session")
def rig_fit() -> Identification:
    """A motion-driven fit: the rig imposes the position, the force is predicted."""
    read = recorded("sine:8", position_noise=0.0, force_noise=2.0)
    imposed, predicted = replace(read["position"], role="input"), replace(read["force"], role="output")
    return identify([Recording.of([read["time"], imposed, predicted], title="rig")])


@pytest.fixture(scope="session")
def drive_fit() -> Identification:
    """A fit of a plant that has no spring, as `bristle fit --without spring` makes it."""
    values = {"mass.m": 95.0, "lugre.fc": 20.0, "lugre.fs": 25.0, "lugre.vs": 3e-3, "lugre.sigma0": 2e5,
              "lugre.sigma1": 800.0, "lugre.sigma2": 203.0}  # fmt: skip
    t = np.arange(2500) / 250.0
    force = 60 * np.sin(np.pi * t) + 30 * np.sin(3.4 * np.pi * t + 1)
    drive = kernel(("inertia", "lugre"))
    run = drive.run(t, force, drive.vector(values), drive.start(0.1), h_max=5e-5)
    rng = np.random.default_rng(0)
    signals = [
        Signal("time", t, "s", "time"),
        Signal("force", force + rng.normal(0, 0.5, len(t)), "N", "input"),
        Signal("position", run.outputs[:, 0] + rng.normal(0, 2e-6, len(t)), "m", "output"),
    ]
    return identify([Recording.of(signals, title="drive")], given={"spring.K": 0.0})


@pytest.fixture(scope="session")
def ramp_fit() -> Identification:
    """A fit of one slow stroke, which leaves several parameters weak."""
    return identify([replace(recorded("ramp:20", valve=7, rate=100.0), title="ramp")])


@pytest.fixture(scope="session")
def short_fit() -> Identification:
    """A fit of thirty samples, with most parameters held."""
    read, (values, _) = recorded("sine:0.2", valve=7, rate=150.0), random_valve(7)
    signals = [replace(read[n], values=read[n].values[:30]) for n in read]
    free = ("lugre.fc", "spring.K", "lugre.sigma1")
    held = {name: value for name, value in values.items() if name not in free}
    return identify([Recording.of(signals, title="short")], given=held, check=False)
