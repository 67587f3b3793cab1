"""Make the bundled recordings: one actuator of the size of a DN50 control valve, three experiments, fixed seeds.

Run from the repository: python -m tools.bundled_recordings
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from recordings import Plant, Recording, write
from simulator import Excitation, Sensors, simulate

VALVE = {
    "mass.m": 2.0, "spring.K": 60892.0, "spring.F0": 580.0, "lugre.fc": 116.0, "lugre.fs": 160.0, "lugre.vs": 2e-3,
    "lugre.sigma0": 3e6, "lugre.sigma1": 2000.0, "lugre.sigma2": 400.0,
}  # fmt: skip
"""Spring and size of the DAMADICS servomotor (38.1 mm, 290 cm2); friction of a 10 % valve signature."""
STROKE, AREA = 0.0381, 0.0290
SENSORS = Sensors(rate=500.0, position_noise=3e-6)
EXPERIMENTS = {
    "step": ("Step responses", "step:6,staircase:14", 1),
    "sine": ("Slow sine over the stroke and a presliding sine", "sine:16,presliding:4", 2),
    "mixed": ("Staircase, sine, multisine and presliding", "mixed:40", 3),
}


def make(name: str) -> tuple[Recording, dict]:  # type: ignore[type-arg]
    """One bundled recording and its truth."""
    title, shapes, seed = EXPERIMENTS[name]
    recording, truth = simulate(VALVE, Excitation.parse(shapes), SENSORS, stroke=STROKE, seed=seed)
    plant = Plant(stroke_m=STROKE, diaphragm_area_m2=AREA, tag="example")
    return replace(recording, title=title, plant=plant), {k: v for k, v in truth.items() if isinstance(v, float | str)}


def main() -> None:
    """Write all of them into the package."""
    folder = Path(__file__).resolve().parent.parent / "recordings" / "library"
    for name in EXPERIMENTS:
        recording, truth = make(name)
        write(folder / f"{name}.h5", recording, truth)
        print(folder / f"{name}.h5", (folder / f"{name}.h5").stat().st_size)


if __name__ == "__main__":
    main()
