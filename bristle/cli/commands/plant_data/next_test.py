"""`bristle next-test`: the experiment that would tell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    models: Annotated[
        list[str], typer.Argument(help="A trace.json, or model.json; several models are rivals to be told apart.")
    ],
    limits: Annotated[
        str | None,
        typer.Option(help="All at once: travel=10:90,rate=20,duration=60 (%, %/s, s); also pressure=40:180 (kPa)."),
    ] = None,
    travel: Annotated[
        str | None, typer.Option(help="LOW:HIGH, where the stem may go, % of the stroke [10:90].")
    ] = None,
    rate: Annotated[float | None, typer.Option(help="Fastest change, % of the stroke in a second [50].")] = None,
    pressure: Annotated[str | None, typer.Option(help="LOW:HIGH, what the pressure may be, kPa.")] = None,
    duration: Annotated[float | None, typer.Option(help="Length of the test, s [60].")] = None,
    drive: Annotated[
        str | None, typer.Option(help="What the sequence asks: force, pressure or setpoint; by default what is known.")
    ] = None,
    sampling: Annotated[float, typer.Option(help="Samples a second of sequence and recording, Hz.")] = 100.0,
    stroke: Annotated[float | None, typer.Option(help="Stroke [m], where the model does not say it.")] = None,
    area: Annotated[float | None, typer.Option(help="Diaphragm area [m2], to turn force into pressure.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the sequence here (sequence.csv).")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML page here.")] = None,
) -> None:
    """Find the test that tells most within limits: between rivals of a trace, or of a model's weak parameters.

    Example: bristle next-test trace.json --travel 20:80 --rate 20 --duration 60 --out sequence.csv --report page.html
    """
    import bristle as br
    from bristle.cli.console import writable
    from bristle.cli.output.manner import present
    from bristle.cli.output.working import working
    from identification.next_test import bounds_of

    for path in (out, report):
        writable(path)
    bounds = bounds_of(limits, travel=travel, rate=rate, pressure=pressure, duration=duration)
    with working("designing the next test", staged=True) as progress:
        found = br.next_test(
            models,
            travel=bounds.travel,
            rate=bounds.rate,
            pressure=bounds.pressure,
            duration=bounds.duration,
            drive=drive,
            sampling=sampling,
            stroke=stroke,
            area=area,
            progress=progress,
        )
    present(found, out, report)
