"""`bristle simulate`: recordings of a simulated valve."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

VALVE, ACTUATOR, SENSORS = "A valve driven by a force", "The DAMADICS actuator", "Sampling and sensors of the valve"


def command(
    to: Annotated[Path, Option(help="Write the recording here (.h5).")],
    excite: Annotated[
        str, Option(help="Shapes with seconds: step:5,sine:20; mixed:40; positioner:60.", rich_help_panel=VALVE)
    ] = "mixed:40",
    valve: Annotated[
        str | None, Option(help="Model (model.json); a seeded random LuGre valve otherwise.", rich_help_panel=VALVE)
    ] = None,
    given: Annotated[
        list[str] | None, Option(help="Set a parameter: lugre.fc=120 (SI units).", rich_help_panel=VALVE)
    ] = None,
    stroke: Annotated[float | None, Option(help="Stroke [m].", rich_help_panel=VALVE)] = None,
    rate: Annotated[float, Option(help="Sampling rate [Hz].", rich_help_panel=SENSORS)] = 500.0,
    position_noise: Annotated[float, Option(help="Position noise, std [m].", rich_help_panel=SENSORS)] = 0.0,
    force_noise: Annotated[float, Option(help="Force noise, std [N].", rich_help_panel=SENSORS)] = 0.0,
    position_step: Annotated[float, Option(help="Position quantum [m].", rich_help_panel=SENSORS)] = 0.0,
    force_step: Annotated[float, Option(help="Force quantum [N].", rich_help_panel=SENSORS)] = 0.0,
    scenario: Annotated[
        str | None, Option(help="Scenario of the benchmark: f7-abrupt-medium, healthy.", rich_help_panel=ACTUATOR)
    ] = None,
    friction: Annotated[
        str, Option(help="play (the benchmark's) or lugre (friction as a force).", rich_help_panel=ACTUATOR)
    ] = "play",
    noise: Annotated[bool, Option("--noise", help="The benchmark's noise.", rich_help_panel=ACTUATOR)] = False,
    duration: Annotated[
        float | None, Option(help="Seconds; the scenario's own otherwise.", rich_help_panel=ACTUATOR)
    ] = None,
    sample: Annotated[float | None, Option(help="Sampling interval [s].", rich_help_panel=ACTUATOR)] = None,
    seed: Annotated[int, Option(help="Seed of valve, excitation and noise.", min=0)] = 0,
) -> None:
    """Simulate a recording, with the truth beside it in the file.

    Example: bristle simulate --to rec.h5 --excite staircase:20,sine:20 --rate 500 --position-noise 3e-6

    Example: bristle simulate --to f7.h5 --scenario f7-abrupt-medium --friction lugre --noise
    """
    from bristle.cli.console import assignments, writable
    from bristle.cli.output.manner import answer, say
    from bristle.cli.output.working import working
    from bristle.cli.simulating import actuator
    from bristle.door.valves import sensed, simulated
    from recordings import write

    writable(to)
    changed = assignments(given or [], "--given")
    with working("simulating"):
        if scenario is not None:
            recording, truth = actuator(scenario, friction, noise, seed, duration, sample)
        else:
            sensors = sensed(rate, position_noise, force_noise, position_step, force_step)
            recording, truth = simulated(excite, given=changed, model=valve, seed=seed, stroke=stroke, sensors=sensors)
    write(to, recording, truth)
    answer({"file": to, "samples": len(recording), "seconds": recording.time[-1], "signals": list(recording)})
    say(f"{to}: {len(recording)} samples, {recording.time[-1]:.6g} s")
