"""`bristle simulate`: recordings of a simulated valve."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    to: Annotated[Path, typer.Option(help="Write the recording here (.h5).")],
    excite: Annotated[
        str, typer.Option(help="Sequence of shapes with seconds: step:5,sine:20; mixed:40; positioner:60.")
    ] = "mixed:40",
    valve: Annotated[
        str | None, typer.Option(help="Model (model.json) to simulate; a seeded random LuGre valve otherwise.")
    ] = None,
    given: Annotated[list[str] | None, typer.Option(help="Set a parameter: lugre.fc=120 (SI units).")] = None,
    stroke: Annotated[float | None, typer.Option(help="Stroke [m].")] = None,
    rate: Annotated[float, typer.Option(help="Sampling rate [Hz].")] = 500.0,
    position_noise: Annotated[float, typer.Option(help="Standard deviation of the position noise [m].")] = 0.0,
    force_noise: Annotated[float, typer.Option(help="Standard deviation of the force noise [N].")] = 0.0,
    position_step: Annotated[float, typer.Option(help="Quantisation step of the position [m].")] = 0.0,
    force_step: Annotated[float, typer.Option(help="Quantisation step of the force [N].")] = 0.0,
    seed: Annotated[int, typer.Option(help="Seed of valve, excitation and noise.")] = 0,
) -> None:
    """Simulate a recording of a valve, with the truth beside it in the file.

    Example: bristle simulate --to rec.h5 --excite staircase:20,sine:20 --rate 500 --position-noise 3e-6
    """
    from bristle._console import assignments, writable
    from recordings import BadInput, write
    from simulator import Excitation, Sensors, ValveModel, random_valve, simulate

    writable(to)
    for name, value in (("--rate", rate), ("--stroke", 1.0 if stroke is None else stroke)):
        if not 0 < value < float("inf"):
            raise BadInput(f"{name} {value}", "it is not positive", "give a positive number")
    values, length = random_valve(seed)
    effects: tuple[str, ...] = ("inertia", "spring", "lugre")
    if valve is not None:
        model = ValveModel.read(valve)
        values, effects, length = model.values, model.effects, float(model.plant.get("stroke_m", length))
    changed = assignments(given or [], "--given")
    unknown = set(changed) - set(values)
    if unknown:
        raise BadInput(f"--given {sorted(unknown)[0]}", "no such parameter", f"there are {', '.join(values)}")
    sensors = Sensors(rate, position_noise, force_noise, position_step, force_step)
    recording, truth = simulate(
        values | changed, Excitation.parse(excite), sensors, stroke=stroke or length, effects=effects, seed=seed
    )
    write(to, recording, truth)
    print(f"{to}: {len(recording)} samples, {recording.time[-1]:.6g} s")
